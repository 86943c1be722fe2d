// A constraint solver for Bullet that solves contacts on an accelerator, by the C interface of zynq-pgs.
//
//     ZynqPgsSolver solver("emulated:float,world");
//     btDiscreteDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
//
// The solver gathers the islands of a step and solves them all in one step of the board. Forces, gyroscopic
// terms, continuous detection, sleeping and the integration stay Bullet's. An island with a joint, or with a
// property of a contact that no board has, goes to Bullet's own solver, from which this class derives, and so
// does a whole step that the board cannot take.
#pragma once

#include <btBulletDynamicsCommon.h>
#include <zynq_pgs.h>

#include <cstdint>
#include <memory>
#include <set>
#include <string>

#include "zynq_pgs_gather.h"

struct ZynqPgsOptions {
    // Passes; 0 takes m_numIterations of the world.
    int contactIterations = 0;
    int frictionIterations = 0;
    // Largest number of points of a collision, 1 to 4. The board applies the friction of a collision at the
    // centre of its points. One place cannot resist a twist about the normal, two places can: with 2 a face
    // that rests on four points has two. With 4 the step has down to half as many collisions, and piles and
    // towers are less stable.
    int pointsPerCollision = 2;
    // Every `reverseEvery` steps the collisions go to the library in reverse order; 0 is never. Towers lean
    // less.
    int reverseEvery = 3;
    // One of zpgs_order.
    uint32_t order = ZPGS_ORDER_AUTOMATIC;
    // A step begins with the impulses of the last one if the world's solver mode says so
    // (SOLVER_USE_WARMSTARTING, which is Bullet's default), and stores its own in Bullet's points. Costs a
    // pass of each kind. A board without impulses does without.
    bool warmStart = true;
    // The library keeps the impulses, and a point its place in the last step, in m_userPersistentData. Without
    // it the impulses come by value, from Bullet's points. Not for a program with data of its own there.
    bool byPlace = false;
    // The board solves islands, too, whose contacts have a property that no board has (rolling friction and
    // others, ZynqPgsGather::property), and leaves the property out.
    bool ignoreProperties = false;
    // With m_splitImpulse a second step takes points deeper than the threshold out by the poses. In the first
    // they have this share of the speed that a point at the threshold has. With 0, which is Bullet's rule, piles
    // of few passes sink; 0.36 is as much as gravity gives in a step of 1/60 s.
    float deepShare = 0.36f;
    // Repetitions of a step that failed on the board, before Bullet's solver takes it.
    uint32_t retries = 1;
};

// An open board. Solvers of several worlds may share one, in one thread; each brings its shapes to its steps.
struct ZynqPgsBoard {
    explicit ZynqPgsBoard(const char *board) : text(board) { open(); }
    ~ZynqPgsBoard() { zpgs_close(accelerator); }
    ZynqPgsBoard(const ZynqPgsBoard &) = delete;
    ZynqPgsBoard &operator=(const ZynqPgsBoard &) = delete;
    // Opens it, anew where it was open.
    void open();

    const std::string text;
    zpgs_accelerator *accelerator = nullptr;
    std::string error;  // why it did not open
    // To be opened again before the next step: its driver has given it up.
    bool reopen = false;
    uint64_t openings = 0;
    uint32_t worlds = 0;
};

struct ZynqPgsCounts {
    // Steps that the board solved, and steps that Bullet's solver took over from it.
    uint64_t boardSteps = 0;
    uint64_t fallbackSteps = 0;
    // Steps on the board that began with impulses.
    uint64_t warmSteps = 0;
    // Groups of islands with joints, which are Bullet's without a fault.
    uint64_t jointGroups = 0;
    // Islands without a joint that are Bullet's because a contact has a property that no board has. Over all
    // steps.
    uint64_t propertyIslands = 0;
    // Steps on the board with a second one, which takes bodies out of deep penetration (m_splitImpulse).
    uint64_t pushSteps = 0;
    // Of the last step on the board.
    size_t bodies = 0;
    size_t collisions = 0;
    size_t points = 0;
    zpgs_report report = {};
    zpgs_report pushReport = {};  // of its second step; zeros if it had none
    // Processor time in the library, s: the packing and the waiting, or the emulation. Over all steps.
    double librarySeconds = 0.0;
};

class ZynqPgsSolver : public btSequentialImpulseConstraintSolver {
public:
    // Opens the board. If this fails, isOpen() is false, and every step is Bullet's.
    explicit ZynqPgsSolver(const char *board, const ZynqPgsOptions &options = ZynqPgsOptions())
        : ZynqPgsSolver(std::make_shared<ZynqPgsBoard>(board), options) {}
    // Of a world that shares the board with others.
    explicit ZynqPgsSolver(std::shared_ptr<ZynqPgsBoard> board,
                           const ZynqPgsOptions &options = ZynqPgsOptions());
    ~ZynqPgsSolver() override;
    ZynqPgsSolver(const ZynqPgsSolver &) = delete;
    ZynqPgsSolver &operator=(const ZynqPgsSolver &) = delete;

    bool isOpen() const { return m_board->accelerator != nullptr; }
    // Why the board did not open, or why the last step on it failed. Empty if neither happened.
    const std::string &lastError() const { return m_lastError; }
    const ZynqPgsCounts &counts() const { return m_counts; }

    void prepareSolve(int bodies, int manifolds) override;
    btScalar solveGroup(btCollisionObject **bodies, int numBodies, btPersistentManifold **manifolds,
                        int numManifolds, btTypedConstraint **constraints, int numConstraints,
                        const btContactSolverInfo &info, btIDebugDraw *debugDrawer,
                        btDispatcher *dispatcher) override;
    void allSolved(const btContactSolverInfo &info, btIDebugDraw *debugDrawer) override;

private:
    void setParameters(const btContactSolverInfo &info, zpgs_parameters &parameters) const;
    bool stepBoard(const btContactSolverInfo &info);
    void loadImpulses(const btContactSolverInfo &info, zpgs_parameters &parameters);
    zpgs_status step(zpgs_bodies &bodies, zpgs_collisions &collisions, zpgs_parameters &parameters,
                     zpgs_report &report);
    zpgs_status push(const btContactSolverInfo &info, zpgs_bodies bodies, zpgs_collisions collisions,
                     zpgs_parameters parameters, zpgs_report &report);
    void fallBack(const btContactSolverInfo &info, btIDebugDraw *debugDrawer);
    bool failed(zpgs_status status);
    void say(const std::string &error);

    const std::shared_ptr<ZynqPgsBoard> m_board;
    const uint32_t m_world;  // its number on the board
    const ZynqPgsOptions m_options;
    // The opening of the board that has the impulses at this world's places.
    uint64_t m_opening = 0;
    // Whether the board takes and gives impulses, once it is known.
    enum class Impulses { Unknown, Has, Lacks } m_boardImpulses = Impulses::Unknown;
    // The tangential impulses of Bullet's points are along the board's tangents, not Bullet's.
    bool m_frictionIsBoards = false;
    uint64_t m_steps = 0;
    ZynqPgsGather m_gather;
    btDispatcher *m_dispatcher = nullptr;
    ZynqPgsCounts m_counts;
    std::string m_lastError;
    bool m_saidError = false;
    std::set<std::string> m_saidProperties;
};
