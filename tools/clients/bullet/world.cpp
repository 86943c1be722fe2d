#include "world.h"

#include <algorithm>

namespace {
const btScalar TIME_STEP = btScalar(1) / 60;
}

World::World(const std::string &board, const ZynqPgsOptions &options, int iterations) {
    if (board.empty()) {
        m_own.reset(new btSequentialImpulseConstraintSolver);
        build(m_own.get(), iterations);
    } else {
        m_board.reset(new ZynqPgsSolver(board.c_str(), options));
        build(m_board.get(), iterations);
    }
}

World::World(std::shared_ptr<ZynqPgsBoard> board, const ZynqPgsOptions &options, int iterations)
    : m_board(new ZynqPgsSolver(std::move(board), options)) {
    build(m_board.get(), iterations);
}

World::World(btConstraintSolver &solver, int iterations) { build(&solver, iterations); }

void World::build(btConstraintSolver *solver, int iterations) {
    m_world.reset(new btDiscreteDynamicsWorld(&m_dispatcher, &m_broadphase, solver, &m_configuration));
    m_world->setGravity(btVector3(0, btScalar(-9.8), 0));
    m_world->getSolverInfo().m_numIterations = iterations;
}

World::~World() {
    for (auto &joint : m_joints) m_world->removeConstraint(joint.get());
    for (auto &body : m_bodies) m_world->removeRigidBody(body.get());
}

btCollisionShape *World::cube() {
    if (!m_cube) m_cube = shape<btBoxShape>(btVector3(0.5f, 0.5f, 0.5f));
    return m_cube;
}

btRigidBody *World::add(btCollisionShape *shape, float mass, const btVector3 &at, float friction,
                        const btQuaternion &turn) {
    btVector3 inertia(0, 0, 0);
    if (mass > 0) shape->calculateLocalInertia(mass, inertia);
    m_motions.emplace_back(new btDefaultMotionState(btTransform(turn, at)));
    btRigidBody::btRigidBodyConstructionInfo info(mass, m_motions.back().get(), shape, inertia);
    info.m_friction = friction;
    m_bodies.emplace_back(new btRigidBody(info));
    m_world->addRigidBody(m_bodies.back().get());
    return m_bodies.back().get();
}

btRigidBody *World::addGround(float friction) {
    return add(shape<btBoxShape>(btVector3(200, 10, 200)), 0, btVector3(0, -10, 0), friction);
}

btRigidBody *World::addPlatform(const btVector3 &halfEdges) {
    btRigidBody *platform = add(shape<btBoxShape>(halfEdges), 0, btVector3(0, -halfEdges.y(), 0));
    platform->setCollisionFlags(platform->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    platform->setActivationState(DISABLE_DEACTIVATION);
    return platform;
}

void World::join(btRigidBody *a, btRigidBody *b, const btVector3 &pivotInA, const btVector3 &pivotInB) {
    m_joints.emplace_back(new btPoint2PointConstraint(*a, *b, pivotInA, pivotInB));
    m_world->addConstraint(m_joints.back().get(), true);
}

btTriangleMesh *World::mesh() {
    m_meshes.emplace_back(new btTriangleMesh);
    return m_meshes.back().get();
}

void World::step(int count) {
    for (int i = 0; i < count; i++) m_world->stepSimulation(TIME_STEP, 0);
}

void World::move(btRigidBody *platform, const btVector3 &to) {
    platform->getMotionState()->setWorldTransform(btTransform(btQuaternion::getIdentity(), to));
}

double World::kineticEnergy() const {
    double energy = 0;
    for (const auto &body : m_bodies) {
        if (body->getInvMass() == 0) continue;
        const btVector3 spin = body->getWorldTransform().getBasis().transpose() * body->getAngularVelocity();
        const btVector3 &inverse = body->getInvInertiaDiagLocal();
        energy += 0.5 * body->getLinearVelocity().length2() / body->getInvMass();
        for (int i = 0; i < 3; i++)
            if (inverse[i] > 0) energy += 0.5 * spin[i] * spin[i] / inverse[i];
    }
    return energy;
}

double World::deepest() const {
    double depth = 0;
    for (int i = 0; i < m_dispatcher.getNumManifolds(); i++) {
        const btPersistentManifold *manifold = m_dispatcher.getManifoldByIndexInternal(i);
        for (int k = 0; k < manifold->getNumContacts(); k++)
            depth = std::max(depth, -double(manifold->getContactPoint(k).getDistance()));
    }
    return 1e3 * depth;
}

int World::asleep() const {
    return int(std::count_if(m_bodies.begin(), m_bodies.end(),
                             [](const auto &body) { return body->getInvMass() > 0 && !body->isActive(); }));
}
