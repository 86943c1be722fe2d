// A Bullet world of one scene, with Bullet's own solver or with the board's.
#pragma once

#include <btBulletDynamicsCommon.h>

#include <memory>
#include <random>
#include <string>
#include <vector>

#include "zynq_pgs_solver.h"

// What the command line asks for.
struct Settings {
    std::string board = "emulated:float,world";
    int iterations = 0;  // 0: each scene's own
    ZynqPgsOptions solver;

    // False if an option makes the limits void.
    bool areOwn() const {
        const ZynqPgsOptions own;
        return iterations == 0 && solver.pointsPerCollision == own.pointsPerCollision &&
               solver.reverseEvery == own.reverseEvery && solver.warmStart == own.warmStart &&
               solver.ignoreProperties == own.ignoreProperties && solver.deepShare == own.deepShare;
    }
};

// Shifts of at most 1 mm, for runs that are nearly equal: some scenes are chaotic. Run 0 has none.
class Shifts {
public:
    explicit Shifts(int run) : m_run(run), m_random(unsigned(run)) {}
    btVector3 next() {
        if (m_run == 0) return btVector3(0, 0, 0);
        const float x = m_shift(m_random);
        return btVector3(x, 0, m_shift(m_random));
    }

private:
    const int m_run;
    std::mt19937 m_random;
    std::uniform_real_distribution<float> m_shift{-0.001f, 0.001f};
};

class World {
public:
    // `board` empty: Bullet's own solver.
    World(const std::string &board, const ZynqPgsOptions &options, int iterations);
    // On a board that it shares with other worlds.
    World(std::shared_ptr<ZynqPgsBoard> board, const ZynqPgsOptions &options, int iterations);
    // On a solver of the caller's, which outlives the world.
    World(btConstraintSolver &solver, int iterations);
    ~World();

    template <class Shape, class... Arguments>
    Shape *shape(Arguments &&...arguments) {
        auto *made = new Shape(std::forward<Arguments>(arguments)...);
        m_shapes.emplace_back(made);
        return made;
    }
    // A cube of 1 m.
    btCollisionShape *cube();
    // Mass 0 is static. Friction is Bullet's, which multiplies those of both bodies.
    btRigidBody *add(btCollisionShape *shape, float mass, const btVector3 &at, float friction = 0.5f,
                     const btQuaternion &turn = btQuaternion::getIdentity());
    // The surface is the plane y = 0.
    btRigidBody *addGround(float friction = 0.5f);
    btRigidBody *addPlatform(const btVector3 &halfEdges);
    void join(btRigidBody *a, btRigidBody *b, const btVector3 &pivotInA, const btVector3 &pivotInB);
    btTriangleMesh *mesh();

    void step(int count = 1);
    void move(btRigidBody *platform, const btVector3 &to);

    btDiscreteDynamicsWorld &bullet() { return *m_world; }
    // Null with Bullet's own solver.
    const ZynqPgsSolver *board() const { return m_board.get(); }
    double kineticEnergy() const;
    // Deepest penetration of the last step, mm.
    double deepest() const;
    int asleep() const;
    const std::vector<std::unique_ptr<btRigidBody>> &bodies() const { return m_bodies; }

private:
    void build(btConstraintSolver *solver, int iterations);

    btDefaultCollisionConfiguration m_configuration;
    btCollisionDispatcher m_dispatcher{&m_configuration};
    btDbvtBroadphase m_broadphase;
    std::unique_ptr<ZynqPgsSolver> m_board;
    std::unique_ptr<btConstraintSolver> m_own;
    std::vector<std::unique_ptr<btTriangleMesh>> m_meshes;
    std::vector<std::unique_ptr<btCollisionShape>> m_shapes;
    std::vector<std::unique_ptr<btMotionState>> m_motions;
    std::vector<std::unique_ptr<btRigidBody>> m_bodies;
    std::vector<std::unique_ptr<btTypedConstraint>> m_joints;
    std::unique_ptr<btDiscreteDynamicsWorld> m_world;
    btCollisionShape *m_cube = nullptr;
};

inline const btVector3 &place(const btRigidBody *body) { return body->getWorldTransform().getOrigin(); }
