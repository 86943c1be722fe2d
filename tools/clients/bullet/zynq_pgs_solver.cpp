#include "zynq_pgs_solver.h"

#include <algorithm>
#include <cstdio>
#include <ctime>

namespace {

// The most passes of a kind that a step takes.
const uint32_t MOST_PASSES = 255;

int islandOf(const btCollisionObject *a, const btCollisionObject *b) {
    return a->getIslandTag() >= 0 ? a->getIslandTag() : b->getIslandTag();
}

bool forget(void *) { return true; }

// A field of all bodies.
zpgs_strided column(float *field) { return {field, sizeof(ZynqPgsGather::Body)}; }

}  // namespace

void ZynqPgsBoard::open() {
    zpgs_close(accelerator);
    reopen = false;
    openings++;
    error = zpgs_open(text.c_str(), &accelerator) == ZPGS_STATUS_OK ? "" : zpgs_last_error(nullptr);
}

ZynqPgsSolver::ZynqPgsSolver(std::shared_ptr<ZynqPgsBoard> board, const ZynqPgsOptions &options)
    : m_board(std::move(board)),
      m_world(m_board->worlds++),
      m_options(options),
      m_gather(options.pointsPerCollision, options.deepShare) {
    // Without a callback Bullet leaves the data of a removed point in its slot, where it expects none later.
    if (options.byPlace && !gContactDestroyedCallback) gContactDestroyedCallback = forget;
    if (!isOpen()) say(m_board->error);
}

ZynqPgsSolver::~ZynqPgsSolver() {
    if (isOpen()) zpgs_forget(m_board->accelerator, m_world);
}

void ZynqPgsSolver::prepareSolve(int bodies, int manifolds) {
    btSequentialImpulseConstraintSolver::prepareSolve(bodies, manifolds);
    m_gather.clear();
}

// Bullet calls this for each island, or for several at once, and allSolved after the last one.
btScalar ZynqPgsSolver::solveGroup(btCollisionObject **bodies, int numBodies,
                                   btPersistentManifold **manifolds, int numManifolds,
                                   btTypedConstraint **constraints, int numConstraints,
                                   const btContactSolverInfo &info, btIDebugDraw *debugDrawer,
                                   btDispatcher *dispatcher) {
    m_dispatcher = dispatcher;
    // A group may hold several islands. Those with a joint are Bullet's, and those with a contact that has a
    // property which no board has.
    std::set<int> bullets;
    for (int i = 0; i < numConstraints; i++)
        bullets.insert(islandOf(&constraints[i]->getRigidBodyA(), &constraints[i]->getRigidBodyB()));
    for (int i = 0; i < numManifolds && !m_options.ignoreProperties; i++) {
        const char *property = ZynqPgsGather::property(*manifolds[i], info);
        if (!property) continue;
        const int island = islandOf(manifolds[i]->getBody0(), manifolds[i]->getBody1());
        m_counts.propertyIslands += bullets.insert(island).second;
        if (m_saidProperties.insert(property).second)
            std::fprintf(stderr, "zynq-pgs: no board has %s: Bullet's own solver takes islands with it\n",
                         property);
    }
    if (bullets.empty()) {
        m_gather.take(bodies, numBodies, manifolds, numManifolds);
        return 0;
    }
    std::vector<btCollisionObject *> ownBodies;
    std::vector<btPersistentManifold *> ownManifolds;
    for (int i = 0; i < numBodies; i++) {
        const bool own = bullets.count(bodies[i]->getIslandTag()) > 0;
        (own ? ownBodies : m_gather.takenBodies()).push_back(bodies[i]);
    }
    for (int i = 0; i < numManifolds; i++) {
        const bool own = bullets.count(islandOf(manifolds[i]->getBody0(), manifolds[i]->getBody1())) > 0;
        (own ? ownManifolds : m_gather.takenManifolds()).push_back(manifolds[i]);
    }
    m_counts.jointGroups += numConstraints > 0;
    return btSequentialImpulseConstraintSolver::solveGroup(
        ownBodies.data(), int(ownBodies.size()), ownManifolds.data(), int(ownManifolds.size()), constraints,
        numConstraints, info, debugDrawer, dispatcher);
}

void ZynqPgsSolver::allSolved(const btContactSolverInfo &info, btIDebugDraw *debugDrawer) {
    if (m_gather.takenBodies().empty()) return;
    m_gather.gather(info);
    if (m_gather.collisions().empty() || stepBoard(info))
        m_gather.write(info);
    else
        fallBack(info, debugDrawer);
    m_gather.clear();
}

void ZynqPgsSolver::setParameters(const btContactSolverInfo &info, zpgs_parameters &parameters) const {
    const int world = info.m_numIterations;
    const int contact = m_options.contactIterations > 0 ? m_options.contactIterations : world;
    const int friction = m_options.frictionIterations > 0 ? m_options.frictionIterations : world;
    parameters.contact_iterations = uint32_t(contact);
    parameters.friction_iterations = uint32_t(friction);
    parameters.integrate = 0;
    parameters.time_step = float(info.m_timeStep);
    // With these two a point's distance is the speed at which it may close: closingSpeed of the gather.
    parameters.position_drift = 0.0f;
    parameters.position_coefficient = parameters.time_step;
    // Bullet has no such damping; it would brake every body that rolls or spins.
    parameters.spin_damping = 0.0f;
    parameters.order = m_options.order;
    parameters.retries = m_options.retries;
    // Not every bitstream has the friction of a pair, so a step asks for it only where it needs it.
    parameters.kinematic = m_gather.hasKinematic();
    const std::vector<float> &frictions = m_gather.frictions();
    parameters.friction = frictions[0];
    for (const float other : frictions)
        if (other != frictions[0]) parameters.pair_friction = 1;
}

// False if the board did not solve the step. Bullet's bodies and points are then as before.
bool ZynqPgsSolver::stepBoard(const btContactSolverInfo &info) {
    if (m_board->reopen) {
        m_board->open();
        if (!isOpen()) say(m_board->error);
    }
    if (!isOpen()) return false;
    if (m_opening != m_board->openings) {
        m_opening = m_board->openings;
        m_gather.forgetPlaces();
        m_boardImpulses = Impulses::Unknown;
    }

    zpgs_parameters parameters;
    if (failed(zpgs_parameters_default(&parameters, sizeof parameters))) return false;
    setParameters(info, parameters);

    std::vector<ZynqPgsGather::Body> &all = m_gather.bodies();
    ZynqPgsGather::Body &first = all[0];
    zpgs_bodies bodies = {};
    bodies.size = sizeof bodies;
    bodies.count = all.size();
    bodies.positions = column(first.position);
    bodies.orientations = column(first.orientation);
    bodies.linear_velocities = column(first.linearVelocity);
    bodies.angular_velocities = column(first.angularVelocity);
    bodies.shapes = {&first.shape, sizeof first};
    bodies.table = m_gather.shapes().data();
    bodies.table_count = m_gather.shapes().size();

    // A pass favours its last collisions; the same ones in every step let a tower lean.
    const int every = m_options.reverseEvery;
    if (every > 0 && ++m_steps % uint64_t(every) == 0) m_gather.reverse();
    loadImpulses(info, parameters);
    std::vector<zpgs_collision> &pairs = m_gather.collisions();
    size_t points = 0;
    for (size_t i = 0; i < pairs.size(); i++) {
        points += pairs[i].count;
        if (parameters.pair_friction)
            pairs[i].count = zpgs_count_with_friction(pairs[i].count, m_gather.frictions()[i]);
    }
    zpgs_collisions collisions = {};
    collisions.size = sizeof collisions;
    collisions.count = pairs.size();
    collisions.collisions = {pairs.data(), sizeof pairs[0]};
    if (m_options.byPlace) {
        collisions.places = m_gather.places().data();
        collisions.world = m_world;
        collisions.factor = float(info.m_warmstartingFactor);
    } else {
        collisions.impulses = {m_gather.impulses().data(), sizeof(zpgs_impulses)};
    }

    zpgs_report report = {};
    report.size = sizeof report;
    const std::clock_t start = std::clock();
    zpgs_status status = step(bodies, collisions, parameters, report);
    std::vector<zpgs_impulses> &impulses = m_gather.impulses();
    if (!parameters.impulses_out)
        impulses.assign(pairs.size(), zpgs_impulses());
    else if (status == ZPGS_STATUS_OK)
        status = zpgs_read_impulses(m_board->accelerator, {impulses.data(), sizeof impulses[0]},
                                    impulses.size());
    zpgs_report pushReport = {};
    pushReport.size = sizeof pushReport;
    const bool pushes = m_gather.isDeep();
    if (pushes && status == ZPGS_STATUS_OK) status = push(info, bodies, collisions, parameters, pushReport);
    m_counts.librarySeconds += double(std::clock() - start) / CLOCKS_PER_SEC;
    // The last thing that can fail: of a step that fails the library keeps nothing.
    const bool commits = m_options.byPlace && parameters.impulses_out && status == ZPGS_STATUS_OK;
    if (commits) status = zpgs_commit(m_board->accelerator, &collisions);
    if (failed(status)) {
        // Otherwise later steps would bring shapes that were refused again, although they need few of them.
        if (status == ZPGS_STATUS_INPUT) m_gather.clearShapes();
        return false;
    }
    if (commits) m_gather.storePlaces();
    m_counts.boardSteps++;
    m_counts.pushSteps += pushes;
    m_counts.pushReport = pushReport;
    m_counts.warmSteps += parameters.warm_start;
    m_counts.bodies = all.size();
    m_counts.collisions = pairs.size();
    m_counts.points = points;
    m_counts.report = report;
    m_gather.storeImpulses();
    m_frictionIsBoards = true;
    return true;
}

// Fetches the impulses that the step begins with. The board gives impulses out even if it takes none: a
// program may read them in Bullet's points.
void ZynqPgsSolver::loadImpulses(const btContactSolverInfo &info, zpgs_parameters &parameters) {
    const bool has = m_options.warmStart && m_boardImpulses != Impulses::Lacks;
    const bool warm =
        has && (info.m_solverMode & SOLVER_USE_WARMSTARTING) && info.m_warmstartingFactor > 0;
    parameters.warm_start = warm;
    parameters.impulses_out = has;
    if (m_options.byPlace) m_gather.loadPlaces();
    m_gather.loadImpulses(warm ? float(info.m_warmstartingFactor) : 0.0f, m_frictionIsBoards);
}

// A step, warm if it is asked for and the board can. A board without impulses refuses a step that gives
// them out before anything is sent, and takes it without them.
zpgs_status ZynqPgsSolver::step(zpgs_bodies &bodies, zpgs_collisions &collisions, zpgs_parameters &parameters,
                                zpgs_report &report) {
    const bool asked = parameters.impulses_out != 0;
    const zpgs_status status = zpgs_step(m_board->accelerator, &bodies, &collisions, &parameters, &report);
    if (status == ZPGS_STATUS_OK && asked) m_boardImpulses = Impulses::Has;
    if (status != ZPGS_STATUS_INPUT || !asked || m_boardImpulses == Impulses::Has) return status;

    // The impulses themselves may be wrong, or the board may have none.
    for (const bool out : {true, false}) {
        parameters.warm_start = 0;
        parameters.impulses_out = out;
        const zpgs_status cold = zpgs_step(m_board->accelerator, &bodies, &collisions, &parameters, &report);
        if (cold == ZPGS_STATUS_INPUT && out) continue;
        if (cold == ZPGS_STATUS_OK) m_boardImpulses = out ? Impulses::Has : Impulses::Lacks;
        return cold;
    }
    return status;
}

// The second step of one with deep points: the bodies, at rest, get the speeds that take them apart in this
// time step. Impulses, friction and the velocities of kinematic bodies have no part in it.
zpgs_status ZynqPgsSolver::push(const btContactSolverInfo &info, zpgs_bodies bodies,
                                zpgs_collisions collisions, zpgs_parameters parameters, zpgs_report &report) {
    std::vector<ZynqPgsGather::Push> &pushes = m_gather.preparePushes(info);
    bodies.linear_velocities = {pushes[0].linear, sizeof pushes[0]};
    bodies.angular_velocities = {pushes[0].angular, sizeof pushes[0]};
    collisions.impulses = {};
    collisions.places = nullptr;
    // It takes as many passes as the first, all of contact.
    parameters.contact_iterations =
        std::min(parameters.contact_iterations + parameters.friction_iterations, MOST_PASSES);
    parameters.friction_iterations = 0;
    parameters.kinematic = 0;
    parameters.warm_start = 0;
    parameters.impulses_out = 0;
    return zpgs_step(m_board->accelerator, &bodies, &collisions, &parameters, &report);
}

void ZynqPgsSolver::fallBack(const btContactSolverInfo &info, btIDebugDraw *debugDrawer) {
    m_counts.fallbackSteps++;
    m_frictionIsBoards = false;
    std::vector<btCollisionObject *> &bodies = m_gather.takenBodies();
    std::vector<btPersistentManifold *> &manifolds = m_gather.takenManifolds();
    btSequentialImpulseConstraintSolver::solveGroup(bodies.data(), int(bodies.size()), manifolds.data(),
                                                    int(manifolds.size()), nullptr, 0, info, debugDrawer,
                                                    m_dispatcher);
}

bool ZynqPgsSolver::failed(zpgs_status status) {
    if (status == ZPGS_STATUS_OK) return false;
    const std::string own = zpgs_last_error(m_board->accelerator);
    say(own.empty() ? zpgs_last_error(nullptr) : own);
    // By the next step on it, once.
    m_board->reopen |= status == ZPGS_STATUS_REOPEN || status == ZPGS_STATUS_PANIC;
    return true;
}

// Keeps every error, and prints the first one: a program that never asks would not notice.
void ZynqPgsSolver::say(const std::string &error) {
    m_lastError = error;
    if (m_saidError) return;
    m_saidError = true;
    std::fprintf(stderr, "zynq-pgs: %s\n", error.c_str());
}
