/* zynq_pgs.h: the C interface of zynq-pgs, driver of an FPGA accelerator for rigid body contacts.
 *
 * cbindgen makes this header from tools/capi/src. docs/engines.md has the conventions. It needs C99 or C++11.
 *
 * - A call returns a zpgs_status; the words of a failure are in zpgs_last_error.
 * - A structure that begins with `size` has sizeof of itself there.
 * - One thread at a time uses an accelerator, but for zpgs_cancel. A forked child does not.
 */

#if defined(__STRICT_ANSI__) && !defined(__cplusplus)
#if !defined(__STDC_VERSION__) || __STDC_VERSION__ < 199901L
#error "zynq_pgs.h needs C99 or newer: compile with -std=c99"
#endif
#endif

#ifndef ZYNQ_PGS_H
#define ZYNQ_PGS_H

#include <stddef.h>
#include <stdint.h>

// Largest number of contact points of a collision.
#define ZPGS_CONTACT_POINTS 4

// `collision` of a `zpgs_place` that the last step did not have.
#define ZPGS_NEW_COLLISION UINT32_MAX

// A point of a `zpgs_place` that the collision did not have.
#define ZPGS_NEW_POINT UINT8_MAX

// Version of the binary interface: the number in the shared library's name. It grows when a
// program that was built with an older header would no longer work.
#define ZPGS_ABI_VERSION 0

// How a call ended, and what the caller can do next. A call that did not end in `ZPGS_STATUS_OK`
// has changed nothing of the caller's, and `zpgs_last_error` has its text. Only `zpgs_open` then
// stores a null handle.
typedef enum zpgs_status {
    // Done.
    ZPGS_STATUS_OK = 0,
    // A pointer is null that must not be: a mistake of the program.
    ZPGS_STATUS_NULL_POINTER = 1,
    // An argument that the interface itself cannot take: a misaligned pointer, a stride, a size, a
    // flag, a text that is not UTF-8.
    ZPGS_STATUS_ARGUMENT = 2,
    // The driver refused the input before it sent anything: correct the input.
    ZPGS_STATUS_INPUT = 3,
    // No board could be opened.
    ZPGS_STATUS_OPEN = 4,
    // The step failed, and the board was reset and works again: make the same call again.
    ZPGS_STATUS_AGAIN = 5,
    // The step failed, and the same call would fail in the same way. The board works.
    ZPGS_STATUS_FAILED = 6,
    // The board could not be reset: close the accelerator and open it again.
    ZPGS_STATUS_REOPEN = 7,
    // `zpgs_cancel` ended the step. The board works, and the next step is not cancelled.
    ZPGS_STATUS_CANCELLED = 8,
    // The call does not fit: a step is in flight, or none is; or no list of collisions is open.
    ZPGS_STATUS_SEQUENCE = 9,
    // Another thread is in a call with the same accelerator.
    ZPGS_STATUS_BUSY = 10,
    // The library met a mistake of its own: close the accelerator. Every later call with the same
    // accelerator ends like this, too.
    ZPGS_STATUS_PANIC = 11,
    // The call came from a child that was forked since `zpgs_open`: the accelerator is its
    // parent's, and nothing was done. Open one after the fork. `zpgs_close` frees memory of the
    // child alone.
    ZPGS_STATUS_FORKED = 12,
} zpgs_status;

// The order in which the board gets the collisions.
typedef enum zpgs_order {
    // The cheapest on the board at hand.
    ZPGS_ORDER_AUTOMATIC = 0,
    // As the caller gives them.
    ZPGS_ORDER_AS_GIVEN = 1,
    // No hazards, collisions near to their given places.
    ZPGS_ORDER_HAZARD_FREE = 3,
    // Far places of the list in turn, for a board with an issue queue.
    ZPGS_ORDER_INTERLEAVED = 8,
} zpgs_order;

// An open accelerator: `zpgs_open` makes it, `zpgs_close` ends it.
//
// One thread at a time may call with it, but for `zpgs_cancel`, which any thread may call. A
// second call at the same time is refused with `ZPGS_STATUS_BUSY`.
typedef struct zpgs_accelerator zpgs_accelerator;

// Mass properties that bodies refer to by index.
typedef struct zpgs_shape {
    // Inverse mass, 1/kg; 0 is static.
    float inverse_mass;
    // Diagonal of the inverse inertia about the body's own axes, 1/(kg m^2). Three unequal numbers
    // need a bitstream with world inertia.
    float inverse_inertia[3];
} zpgs_shape;

// The parameters of a step. `zpgs_parameters_default` fills it in; the caller then changes fields.
//
// A flag is 0 for no and 1 for yes.
typedef struct zpgs_parameters {
    // Size of the structure, as the caller's header has it: `zpgs_parameters_default` sets it.
    size_t size;
    // Time step, s.
    float time_step;
    // Penetration that the solver leaves alone, m.
    float position_drift;
    // Share of the penetration that a step removes.
    float position_coefficient;
    // Friction coefficient of every contact, unless each collision has its own.
    float friction;
    // Share of the angular velocity that a step with integration leaves, from 0 to 1.
    float angular_damping;
    // Share of the spin about the normal that every friction pass takes, from 0 to 1: 10 % in the
    // thesis, 0 here.
    float spin_damping;
    // Gravity, m/s^2, world frame; only a step with integration uses it.
    float gravity[3];
    // Passes of the contact solver over all collisions.
    uint32_t contact_iterations;
    // Passes of the friction solver over all collisions.
    uint32_t friction_iterations;
    // Flag: each collision has a friction of its own (`zpgs_count_with_friction`).
    uint32_t pair_friction;
    // Flag: integrate after the solver. Without it the velocities come back as the solver left
    // them, and the poses stay.
    uint32_t integrate;
    // Flag: static bodies may move, by the velocity that they come with.
    uint32_t kinematic;
    // Flag: verify before anything is sent that the order has no hazards. For debugging.
    uint32_t verify_order;
    // One of `zpgs_order`.
    uint32_t order;
    // Time limit of a step on the board, ms; 0 derives it from the work.
    uint32_t deadline_ms;
    // Number of repetitions of a step that failed, each after a reset. `zpgs_submit` ignores it.
    uint32_t retries;
    // Flag: begin with the impulses of `zpgs_collisions` or `zpgs_push`, in one more pass of each
    // kind.
    uint32_t warm_start;
    // Flag: keep the impulses of the step for `zpgs_read_impulses`.
    uint32_t impulses_out;
} zpgs_parameters;

// An array that the library reads and writes: element `i` lies `i * stride` bytes behind `data`.
//
// Address and stride are multiples of 4, or of 8 for doubles, and the stride is at least the size
// of an element. An array of structures has the size of its structure as the stride, a dense array
// that of its element. `data` may be null if the array has no element.
typedef struct zpgs_strided {
    // The first element.
    void *data;
    // Bytes from one element to the next.
    size_t stride;
} zpgs_strided;

// An array that the library only reads; as `zpgs_strided`.
typedef struct zpgs_strided_const {
    // The first element.
    const void *data;
    // Bytes from one element to the next.
    size_t stride;
} zpgs_strided_const;

// The bodies of a step, in the caller's own memory. Units are m, s, kg and rad, in the world
// frame.
//
// During a call no other thread writes the arrays. A call with bodies refuses arrays that share a
// byte with each other or with another of its arguments. Elements of several arrays may alternate,
// as the members of an array of structures do.
typedef struct zpgs_bodies {
    // Size of the structure, as the caller's header has it.
    size_t size;
    // Number of bodies.
    size_t count;
    // Centres of mass, m: `float[3]`.
    struct zpgs_strided positions;
    // Unit quaternions x, y, z, w: `float[4]`.
    struct zpgs_strided orientations;
    // Velocities of the centres of mass, m/s: `float[3]`.
    struct zpgs_strided linear_velocities;
    // Angular velocities, rad/s: `float[3]`.
    struct zpgs_strided angular_velocities;
    // Indices into the shapes: `uint32_t`.
    struct zpgs_strided_const shapes;
    // The shapes of this world, a dense array: the step loads them where the accelerator has
    // others, so that worlds with shapes of their own share it. They stay loaded, also where the
    // step is refused.
    const struct zpgs_shape *table;
    // Number of these shapes. 0: the step takes the shapes that the accelerator has.
    size_t table_count;
    // Bytes of a number in the arrays above: 4 or 0 for `float`, 8 for `double`, which the board
    // gets rounded. A number that a step has not changed keeps all its digits.
    size_t number_size;
    // The place that the board takes for 0, m: near the bodies in a large world of doubles. The
    // contact points are relative to it, too.
    double origin[3];
} zpgs_bodies;

// Where a collision was in the last step of its world.
//
// The points of that collision had equal shares of its friction. One that is not named takes its
// share along; two collisions that name points of one each begin with the shares of theirs.
typedef struct zpgs_place {
    // Its index among the collisions of that step, or `ZPGS_NEW_COLLISION`.
    uint32_t collision;
    // For each contact point its index among the points of that collision, or `ZPGS_NEW_POINT`.
    // The elements from the number of points on count for nothing, but must be valid.
    uint8_t points[ZPGS_CONTACT_POINTS];
} zpgs_place;

// The collisions of a step, in the caller's own memory.
//
// During a call no thread writes them. A step refuses them where they share a byte with the
// bodies.
typedef struct zpgs_collisions {
    // Size of the structure, as the caller's header has it.
    size_t size;
    // Number of collisions.
    size_t count;
    // The collisions: `zpgs_collision`. A step reads a dense array without a copy.
    struct zpgs_strided_const collisions;
    // The impulses that a step with `warm_start` begins with: `zpgs_impulses`, one for each
    // collision. Null without a warm start, and where the impulses come by place.
    struct zpgs_strided_const impulses;
    // Where each collision was in the last step of its world that `zpgs_commit` has kept: a
    // dense array. Null without a warm start by place.
    const struct zpgs_place *places;
    // The share of the impulses at the places that a step begins with, such as 0.85. A warm start
    // with 0 is refused: it would be a cold one that takes longer.
    float factor;
    // The world: any number. Each one has a last step of its own.
    uint32_t world;
} zpgs_collisions;

// Counts and times of one step. The caller sets `size` to `sizeof(zpgs_report)` before the call.
typedef struct zpgs_report {
    // Size of the structure, as the caller's header has it.
    size_t size;
    // Clock cycles of the board from start to done.
    uint64_t cycles;
    // Cycles in which a collision waited for a velocity of an earlier one.
    uint64_t stalls;
    // Cycles in which the board waited for memory.
    uint64_t waits;
    // Collisions that met a hazard, over all passes.
    uint64_t hazards;
    // Time from start to done by the board's clock, s; 0 if the bitstream gives no clock.
    double seconds;
    // Sum of the normal impulses after the last contact pass, N s; not a number if the bitstream
    // does not count it, or not as far.
    double impulse_sum;
    // Number of bodies.
    uint64_t bodies;
    // Number of collisions with contact points.
    uint64_t collisions;
    // Number of repetitions after faults.
    uint64_t retries;
} zpgs_report;

// One point at which two bodies touch.
typedef struct zpgs_contact {
    // The point on the surface of body B, world frame, m.
    float point[3];
    // Signed distance along the normal, m. The surface of body A is at `point + distance *
    // normal`; negative is penetration.
    float distance;
} zpgs_contact;

// Two bodies in contact at one to four points. A collision of count 0 is empty: it has no effect
// and keeps its index.
typedef struct zpgs_collision {
    // Index of body A.
    uint32_t body_a;
    // Index of body B.
    uint32_t body_b;
    // Unit normal from body B to body A, world frame.
    float normal[3];
    // Number of contact points, 0 to `ZPGS_CONTACT_POINTS`. `zpgs_count_with_friction` adds a
    // friction of the pair.
    uint32_t count;
    // The contact points. The elements from `count` on are ignored, but must be initialised.
    struct zpgs_contact contacts[ZPGS_CONTACT_POINTS];
} zpgs_collision;

// The impulses of a collision, accumulated over the passes of a step, N s.
typedef struct zpgs_impulses {
    // Along the normal, at each contact point; positive pushes body A along the normal. The
    // elements behind the number of points come out as 0 and are ignored where they go in.
    float normal[ZPGS_CONTACT_POINTS];
    // Along the two tangents of the collision, at the centre of its points.
    float friction[2];
} zpgs_impulses;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The version of the library, such as "0.1.0". The text lives as long as the library.
const char *zpgs_version(void);

// The `ZPGS_ABI_VERSION` of the library.
uint32_t zpgs_abi_version(void);

// Opens a board.
//
// `board` names it: `auto`, `uio` or `uio:NODE`, `devmem`, `emulated` or with a build, such as
// `emulated:float,world`, or `socket:PATH`. `accelerator` receives the handle, or null where the
// call fails; `zpgs_last_error` of null then has the text.
//
// # Safety
// `board` is null or a text that ends with a null byte and that no thread writes during the call;
// `accelerator` is null or the address of a pointer that no other thread uses during the call.
enum zpgs_status zpgs_open(const char *board, struct zpgs_accelerator **accelerator);

// Closes an accelerator, and stops a step in flight. Null does nothing. In a child that was forked
// since `zpgs_open` it frees memory of the child alone, and the parent's board goes on.
//
// # Safety
// `accelerator` is null or from `zpgs_open`, is closed once, and no other thread uses it.
enum zpgs_status zpgs_close(struct zpgs_accelerator *accelerator);

// The text of the last failed call with that accelerator: what was expected, what was found and
// what to do, with every cause. It stays until another call with the accelerator fails. Empty if
// none failed.
//
// With null: the text of this thread's last failed call without an accelerator (`zpgs_open`, a
// null handle), or with one that another thread used (`ZPGS_STATUS_BUSY`). It stays until the
// thread's next call of this kind fails. Never null. In a forked child this is the text with the
// accelerator of its parent, too.
//
// # Safety
// `accelerator` is null or from `zpgs_open`, and not closed before the call returns.
const char *zpgs_last_error(const struct zpgs_accelerator *accelerator);

// Loads `count` shapes, in place of all earlier ones; bodies refer to them by index. Not while a
// step is in flight.
//
// # Safety
// `accelerator` is null or from `zpgs_open`, and not closed before the call returns; `shapes` is
// null or the address of `count` shapes that no thread writes during the call.
enum zpgs_status zpgs_set_shapes(struct zpgs_accelerator *accelerator,
                                 const struct zpgs_shape *shapes,
                                 size_t count);

// Fills in the parameters of a step: Bullet's at 60 steps a second, without damping of spin.
// `size` is `sizeof(zpgs_parameters)`.
//
// # Safety
// `parameters` is null or the address of `size` bytes that no other thread uses during the call.
enum zpgs_status zpgs_parameters_default(struct zpgs_parameters *parameters, size_t size);

// The `count` of a collision with a friction coefficient of its own, rounded to three digits, for
// `pair_friction` of `zpgs_parameters`. A step refuses a friction that is negative or not finite.
// A count of 0 stays 0.
uint32_t zpgs_count_with_friction(uint32_t count, float friction);

// Solves the contacts of one time step, and integrates it if the parameters say so. Returns when
// it is done. The bodies change only if the step succeeds, and then all at once.
//
// `report` may be null.
//
// # Safety
// `accelerator` is null or from `zpgs_open`, and not closed before the call returns. Every other
// pointer is null or the address of its structure, with the size in it. The arrays are as
// `zpgs_bodies` and `zpgs_collisions` describe. No other thread uses the structures or the arrays
// during the call.
enum zpgs_status zpgs_step(struct zpgs_accelerator *accelerator,
                           const struct zpgs_bodies *bodies,
                           const struct zpgs_collisions *collisions,
                           const struct zpgs_parameters *parameters,
                           struct zpgs_report *report);

// Starts a step and returns at once. The arrays are the caller's again when the call returns. At
// most one step of an accelerator is in flight; `zpgs_wait` ends it.
//
// # Safety
// As `zpgs_step`.
enum zpgs_status zpgs_submit(struct zpgs_accelerator *accelerator,
                             const struct zpgs_bodies *bodies,
                             const struct zpgs_collisions *collisions,
                             const struct zpgs_parameters *parameters);

// Waits for the step in flight and stores its results in `bodies`. The caller gives the bodies of
// `zpgs_submit`, whose arrays may have moved. Afterwards no step is in flight, also where the call
// fails, unless the status is `ZPGS_STATUS_NULL_POINTER`, `ZPGS_STATUS_ARGUMENT` or
// `ZPGS_STATUS_BUSY`.
//
// `report` may be null.
//
// # Safety
// As `zpgs_step`.
enum zpgs_status zpgs_wait(struct zpgs_accelerator *accelerator,
                           const struct zpgs_bodies *bodies,
                           struct zpgs_report *report);

// Stores the impulses of each collision of the last step that succeeded with `impulses_out`, in
// the order of its collisions. `impulses` has `count` elements of `zpgs_impulses`, and `count` is
// the number of collisions of that step. For the warm start of the next step, sounds, damage.
//
// # Safety
// `accelerator` is null or from `zpgs_open`, and not closed before the call returns. `impulses` is
// as `zpgs_strided` describes, and no other thread uses its elements during the call.
enum zpgs_status zpgs_read_impulses(struct zpgs_accelerator *accelerator,
                                    struct zpgs_strided impulses,
                                    size_t count);

// Keeps the impulses of the last step that succeeded with `impulses_out`, for the places of the
// next step of the same world. `collisions` are the ones of that step, unchanged; its `world` names
// the world, its places are not looked at. Call it after each step that has succeeded, before
// another one of the accelerator ends, and after no other: a step that failed then begins with the
// same impulses when it is given again.
//
// # Safety
// `accelerator` is null or from `zpgs_open`, and not closed before the call returns. `collisions`
// is null or the address of its structure, with the size in it, whose arrays are as it describes;
// no other thread writes them during the call.
enum zpgs_status zpgs_commit(struct zpgs_accelerator *accelerator,
                             const struct zpgs_collisions *collisions);

// Forgets the last step of a world that `zpgs_commit` has kept, and frees its memory: all
// collisions of the next step are then new. A world without a kept step is no error.
// `zpgs_close` forgets every world.
//
// # Safety
// `accelerator` is null or from `zpgs_open`, and not closed before the call returns.
enum zpgs_status zpgs_forget(struct zpgs_accelerator *accelerator, uint32_t world);

// Ends the step in flight or in work, or else the next one, within about ten milliseconds of the
// board's time: the call that waits for it returns `ZPGS_STATUS_CANCELLED`, and the bodies stay.
// The step after it is not cancelled. Any thread may call it at any time, also during another
// call.
//
// # Safety
// `accelerator` is null or from `zpgs_open`, and not closed before the call returns.
enum zpgs_status zpgs_cancel(const struct zpgs_accelerator *accelerator);

// Checks, orders and packs another step while one is in flight, in place of one that was prepared
// before. The arrays are the caller's again when the call returns; the step has their values of
// now, so that it cannot depend on the results of the step in flight.
//
// # Safety
// As `zpgs_step`.
enum zpgs_status zpgs_prepare(struct zpgs_accelerator *accelerator,
                              const struct zpgs_bodies *bodies,
                              const struct zpgs_collisions *collisions,
                              const struct zpgs_parameters *parameters);

// Waits as `zpgs_wait`, and starts the prepared step as soon as the board has ended the one in
// flight: the results are read while the board works on the next step.
//
// The status is that of the step that has ended. `started` gets the status of the start, and a
// step is in flight afterwards if it is `ZPGS_STATUS_OK`, whatever became of the step before:
// `zpgs_wait` ends it, with its own bodies. It is `ZPGS_STATUS_SEQUENCE` where nothing was started
// because the call was refused. `zpgs_last_error` has the text of the step that has ended or, if
// that is done, of the start.
//
// `report` may be null.
//
// # Safety
// As `zpgs_step`; `started` is null or the address of a status that no other thread uses during
// the call.
enum zpgs_status zpgs_wait_and_start(struct zpgs_accelerator *accelerator,
                                     const struct zpgs_bodies *bodies,
                                     struct zpgs_report *report,
                                     enum zpgs_status *started);

// Starts the prepared step, with none in flight. It may be started again, as after a fault.
//
// # Safety
// `accelerator` is null or from `zpgs_open`, and not closed before the call returns.
enum zpgs_status zpgs_start(struct zpgs_accelerator *accelerator);

// Begins a list of collisions in memory of the library, in place of an earlier one. `zpgs_push`
// appends to it, and `zpgs_end` submits its step. A list may begin and grow while a step is in
// flight.
//
// # Safety
// `accelerator` is null or from `zpgs_open`, and not closed before the call returns.
enum zpgs_status zpgs_begin(struct zpgs_accelerator *accelerator);

// Appends `count` collisions to the list, all or none. The arrays are the caller's again when the
// call returns.
//
// A collision of count 0 keeps its index. `impulses` has the impulses that a step with
// `warm_start` begins with, one `zpgs_impulses` a collision, zeros for a new one. It may be null
// if no step of the list starts warm. `zpgs_end` checks the values of both. A warm start by place
// needs the arrays of `zpgs_collisions`, in `zpgs_step`, `zpgs_submit` or `zpgs_prepare`.
//
// # Safety
// `accelerator` is null or from `zpgs_open`, and not closed before the call returns. `collisions`
// is null or the address of `count` collisions, and `impulses` is null or that of `count`
// impulses; no thread writes them during the call.
enum zpgs_status zpgs_push(struct zpgs_accelerator *accelerator,
                           const struct zpgs_collision *collisions,
                           const struct zpgs_impulses *impulses,
                           size_t count);

// Submits the step of the list, as `zpgs_submit`, and ends the list. The bodies are read now.
// `zpgs_wait` ends the step.
//
// A list that has ended takes no more collisions. It stays until the next `zpgs_begin`, so that
// its step can be submitted again, as after a fault. If the call fails the list is as before.
//
// # Safety
// As `zpgs_step`.
enum zpgs_status zpgs_end(struct zpgs_accelerator *accelerator,
                          const struct zpgs_bodies *bodies,
                          const struct zpgs_parameters *parameters);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* ZYNQ_PGS_H */
