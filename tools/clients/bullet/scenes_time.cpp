// The time of a step: the adapter with the board, and Bullet's own solver, on the same manifolds in one
// process.
#include <algorithm>
#include <ctime>
#include <random>

#include "table.h"

namespace {

// Solves beside the one that the world follows.
struct Beside {
    ZynqPgsSolver &solver;
    std::vector<double> seconds, hostSeconds;
    double boardSeconds = 0, cycles = 0;
};

double since(std::clock_t start) { return double(std::clock() - start) / CLOCKS_PER_SEC; }

// Bullet's solver, which the world follows. While `measures` is set the others get every group first; what
// they wrote is then put back.
class Shadow : public btSequentialImpulseConstraintSolver {
public:
    bool measures = false;
    std::vector<Beside> others;
    std::vector<double> ownSeconds;

    btScalar solveGroup(btCollisionObject **bodies, int numBodies, btPersistentManifold **manifolds,
                        int numManifolds, btTypedConstraint **constraints, int numConstraints,
                        const btContactSolverInfo &info, btIDebugDraw *debugDrawer,
                        btDispatcher *dispatcher) override {
        for (size_t i = 0; measures && i < others.size(); i++) {
            Beside &other = others[i];
            const Kept kept(bodies, numBodies, manifolds, numManifolds);
            const ZynqPgsCounts &counts = other.solver.counts();
            const double library = counts.librarySeconds;
            const std::clock_t start = std::clock();
            other.solver.prepareSolve(numBodies, numManifolds);
            other.solver.solveGroup(bodies, numBodies, manifolds, numManifolds, constraints, numConstraints,
                                    info, debugDrawer, dispatcher);
            other.solver.allSolved(info, debugDrawer);
            other.seconds.push_back(since(start));
            other.hostSeconds.push_back(other.seconds.back() - (counts.librarySeconds - library));
            other.boardSeconds += counts.report.seconds + counts.pushReport.seconds;
            other.cycles += double(counts.report.cycles);
        }
        const std::clock_t start = std::clock();
        const btScalar result = btSequentialImpulseConstraintSolver::solveGroup(
            bodies, numBodies, manifolds, numManifolds, constraints, numConstraints, info, debugDrawer,
            dispatcher);
        if (measures) ownSeconds.push_back(since(start));
        return result;
    }

private:
    struct Kept {
        struct Motion {
            btRigidBody *body;
            btTransform pose;
            btVector3 linear, angular;
        };
        struct Impulses {
            btManifoldPoint *point;
            btScalar normal, lateral1, lateral2;
        };
        std::vector<Motion> motions;
        std::vector<Impulses> impulses;
        Kept(btCollisionObject **bodies, int numBodies, btPersistentManifold **manifolds, int numManifolds) {
            for (int i = 0; i < numBodies; i++)
                if (btRigidBody *body = btRigidBody::upcast(bodies[i]))
                    motions.push_back({body, body->getWorldTransform(), body->getLinearVelocity(),
                                       body->getAngularVelocity()});
            for (int i = 0; i < numManifolds; i++)
                for (int k = 0; k < manifolds[i]->getNumContacts(); k++) {
                    btManifoldPoint &point = manifolds[i]->getContactPoint(k);
                    impulses.push_back({&point, point.m_appliedImpulse, point.m_appliedImpulseLateral1,
                                        point.m_appliedImpulseLateral2});
                }
        }
        ~Kept() {
            for (const Motion &kept : motions) {
                kept.body->setWorldTransform(kept.pose);
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
};

double medianMs(std::vector<double> seconds) {
    if (seconds.empty()) return NONE;
    std::nth_element(seconds.begin(), seconds.begin() + seconds.size() / 2, seconds.end());
    return 1e3 * seconds[seconds.size() / 2];
}

// Jumbled cubes, `edge` along each side, fall for a while; the solvers beside then take STEPS steps.
const int STEPS = 20;
void runCubes(Shadow &shadow, int edge, int iterations) {
    World world(shadow, iterations);
    // One group of all islands, so that all solvers get the step at once.
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
    shadow.measures = true;
    world.step(STEPS);
}

// A row if the board did not take every step.
void addUntaken(Table &table, const ZynqPgsSolver &board, const std::string &scene) {
    const uint64_t untaken = board.counts().fallbackSteps;
    if (untaken == 0) return;
    table.add(NONE, double(untaken), scene + "steps that the board did not take", "", within(0, 0));
}

void timeCubes(Table &table, int edge) {
    const Settings &settings = table.settings();
    ZynqPgsSolver board(settings.board.c_str(), settings.solver);
    Shadow shadow;
    shadow.others.push_back({board, {}, {}});
    runCubes(shadow, edge, table.iterations(10));

    const Beside &other = shadow.others[0];
    const std::string cubes = std::to_string(edge * edge * edge) + " cubes: ";
    addUntaken(table, board, cubes);
    table.add(NONE, double(board.counts().collisions), cubes + "collisions of the last step", "");
    table.add(medianMs(shadow.ownSeconds), medianMs(other.seconds), cubes + "solver, processor time", "ms");
    table.add(NONE, medianMs(other.hostSeconds), cubes + "in the adapter, processor time", "ms");
    table.add(NONE, 1e3 * other.boardSeconds / STEPS, cubes + "the board's own time (modelled)", "ms");
}

void warmCubes(Table &table, int ownIterations) {
    const Settings &settings = table.settings();
    ZynqPgsOptions cold = settings.solver, warm = settings.solver;
    cold.warmStart = false;
    warm.warmStart = true;
    ZynqPgsSolver coldBoard(settings.board.c_str(), cold), warmBoard(settings.board.c_str(), warm);
    Shadow shadow;
    shadow.others.push_back({coldBoard, {}, {}});
    shadow.others.push_back({warmBoard, {}, {}});
    const int iterations = table.iterations(ownIterations);
    runCubes(shadow, 10, iterations);

    const std::string passes = std::to_string(iterations) + " + " + std::to_string(iterations) + " passes: ";
    addUntaken(table, coldBoard, passes);
    addUntaken(table, warmBoard, passes);
    const double without = shadow.others[0].cycles / STEPS, with = shadow.others[1].cycles / STEPS;
    table.add(NONE, without, passes + "cycles of a step without impulses", "");
    table.add(NONE, with, passes + "cycles of a step with impulses", "");
    table.add(NONE, with / without, passes + "ratio of the two", "");
    if (warmBoard.counts().warmSteps == 0) table.add(NONE, NONE, passes + "this board takes no impulses", "");
}

}  // namespace

void warmth(Table &table) {
    warmCubes(table, 4);
    warmCubes(table, 10);
}

void timing(Table &table) {
    timeCubes(table, 10);
    timeCubes(table, 20);
}
