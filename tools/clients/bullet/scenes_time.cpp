// The time of a step: the adapter with the board, and Bullet's own solver, on the same manifolds in one
// process.
#include <algorithm>
#include <ctime>
#include <random>

#include "table.h"

namespace {

// Bullet's solver, which the world follows. While `beside` is set the other solver gets every group first;
// what it wrote is then put back.
class Shadow : public btSequentialImpulseConstraintSolver {
public:
    explicit Shadow(ZynqPgsSolver &other) : m_other(other) {}
    bool beside = false;
    std::vector<double> ownSeconds, otherSeconds, otherHostSeconds;
    double boardSeconds = 0;

    btScalar solveGroup(btCollisionObject **bodies, int numBodies, btPersistentManifold **manifolds,
                        int numManifolds, btTypedConstraint **constraints, int numConstraints,
                        const btContactSolverInfo &info, btIDebugDraw *debugDrawer,
                        btDispatcher *dispatcher) override {
        if (beside) {
            const Kept kept(bodies, numBodies, manifolds, numManifolds);
            const double library = m_other.counts().librarySeconds;
            const std::clock_t start = std::clock();
            m_other.prepareSolve(numBodies, numManifolds);
            m_other.solveGroup(bodies, numBodies, manifolds, numManifolds, constraints, numConstraints, info,
                               debugDrawer, dispatcher);
            m_other.allSolved(info, debugDrawer);
            otherSeconds.push_back(since(start));
            otherHostSeconds.push_back(otherSeconds.back() - (m_other.counts().librarySeconds - library));
            boardSeconds += m_other.counts().report.seconds;
        }
        const std::clock_t start = std::clock();
        const btScalar result = btSequentialImpulseConstraintSolver::solveGroup(
            bodies, numBodies, manifolds, numManifolds, constraints, numConstraints, info, debugDrawer,
            dispatcher);
        if (beside) ownSeconds.push_back(since(start));
        return result;
    }

private:
    struct Kept {
        struct Velocities {
            btRigidBody *body;
            btVector3 linear, angular;
        };
        struct Impulses {
            btManifoldPoint *point;
            btScalar normal, lateral1, lateral2;
        };
        std::vector<Velocities> velocities;
        std::vector<Impulses> impulses;
        Kept(btCollisionObject **bodies, int numBodies, btPersistentManifold **manifolds, int numManifolds) {
            for (int i = 0; i < numBodies; i++)
                if (btRigidBody *body = btRigidBody::upcast(bodies[i]))
                    velocities.push_back({body, body->getLinearVelocity(), body->getAngularVelocity()});
            for (int i = 0; i < numManifolds; i++)
                for (int k = 0; k < manifolds[i]->getNumContacts(); k++) {
                    btManifoldPoint &point = manifolds[i]->getContactPoint(k);
                    impulses.push_back({&point, point.m_appliedImpulse, point.m_appliedImpulseLateral1,
                                        point.m_appliedImpulseLateral2});
                }
        }
        ~Kept() {
            for (const Velocities &kept : velocities) {
                kept.body->setLinearVelocity(kept.linear);
                kept.body->setAngularVelocity(kept.angular);
            }
            for (const Impulses &kept : impulses) {
                kept.point->m_appliedImpulse = kept.normal;
                kept.point->m_appliedImpulseLateral1 = kept.lateral1;
                kept.point->m_appliedImpulseLateral2 = kept.lateral2;
            }
        }
    };
    static double since(std::clock_t start) { return double(std::clock() - start) / CLOCKS_PER_SEC; }

    ZynqPgsSolver &m_other;
};

double medianMs(std::vector<double> seconds) {
    if (seconds.empty()) return NONE;
    std::nth_element(seconds.begin(), seconds.begin() + seconds.size() / 2, seconds.end());
    return 1e3 * seconds[seconds.size() / 2];
}

void timeCubes(Table &table, int edge) {
    ZynqPgsOptions options;
    options.pointsPerCollision = table.settings().points;
    ZynqPgsSolver board(table.settings().board.c_str(), options);
    Shadow shadow(board);
    World world(shadow, table.iterations(10));
    // One group of all islands, so that both solvers get the step at once.
    world.bullet().getSolverInfo().m_minimumSolverBatchSize = 1 << 30;
    world.addGround();
    std::mt19937 random(1);
    std::uniform_real_distribution<float> part(-1, 1);
    for (int i = 0; i < edge * edge * edge; i++) {
        btQuaternion turn(part(random), part(random), part(random), part(random));
        turn.normalize();
        const int x = i % edge, z = i / edge % edge, y = i / edge / edge;
        const btVector3 at(1.5f * float(x) - 6, 1.5f + 1.5f * float(y), 1.5f * float(z) - 6);
        world.add(world.cube(), 1, at, 0.5f, turn)->setActivationState(DISABLE_DEACTIVATION);
    }
    world.step(150);
    shadow.beside = true;
    const int steps = 20;
    world.step(steps);

    const ZynqPgsCounts &counts = board.counts();
    const std::string bodies = std::to_string(edge * edge * edge) + " cubes: ";
    if (counts.fallbackSteps > 0) {
        const double untaken = double(counts.fallbackSteps);
        table.add(NONE, untaken, bodies + "steps that the board did not take", "", within(0, 0));
    }
    table.add(NONE, double(counts.collisions), bodies + "collisions of the last step", "");
    table.add(medianMs(shadow.ownSeconds), medianMs(shadow.otherSeconds), bodies + "solver, processor time",
              "ms");
    table.add(NONE, medianMs(shadow.otherHostSeconds), bodies + "part of it in the adapter", "ms");
    table.add(NONE, 1e3 * shadow.boardSeconds / steps, bodies + "the board's own time (modelled)", "ms");
}

}  // namespace

void timing(Table &table) {
    timeCubes(table, 10);
    timeCubes(table, 20);
}
