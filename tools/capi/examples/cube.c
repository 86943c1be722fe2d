/* Drops a cube on a static ground on the emulated board, and prints the digest of the bodies.
 *
 * Build: cc cube.c $(pkg-config --cflags --libs zynq-pgs) -o cube
 */
#include <stdio.h>
#include <string.h>

#include <zynq_pgs.h>

/* The program's own body: the library reads and writes its fields where they lie. */
struct body {
    float position[3], orientation[4];
    float linear_velocity[3], angular_velocity[3];
    uint32_t shape;
};

enum { GROUND, CUBE, BODIES, STEPS = 90 };

/* The half length of the edges of both bodies, m. */
static const float HALF = 1.0f;

/* A turned cube would touch the ground elsewhere; the four corners below stay under this one. */
static zpgs_collision collide(const struct body *cube) {
    static const float signs[4][2] = {{-1, -1}, {1, -1}, {-1, 1}, {1, 1}};
    const float depth = cube->position[1] - HALF;
    zpgs_collision collision;
    int i;
    memset(&collision, 0, sizeof collision);
    collision.body_a = GROUND;
    collision.body_b = CUBE;
    collision.normal[1] = -1.0f; /* from the cube to the ground */
    collision.count = depth < 0.0f ? 4 : 0; /* 0 is no contact */
    for (i = 0; i < 4; i++) {
        collision.contacts[i].point[0] = cube->position[0] + signs[i][0] * HALF;
        collision.contacts[i].point[1] = depth;
        collision.contacts[i].point[2] = cube->position[2] + signs[i][1] * HALF;
        collision.contacts[i].distance = depth;
    }
    return collision;
}

static uint64_t fnv1a(uint64_t digest, const float *numbers, int count) {
    int i, shift;
    for (i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &numbers[i], sizeof bits);
        for (shift = 0; shift < 32; shift += 8)
            digest = (digest ^ ((bits >> shift) & 0xff)) * 0x100000001b3u;
    }
    return digest;
}

static int failed(const zpgs_accelerator *accelerator, const char *call, zpgs_status status) {
    fprintf(stderr, "%s: status %d: %s\n", call, (int)status, zpgs_last_error(accelerator));
    return 1;
}

/* An array of one field of the bodies. */
static zpgs_strided column(void *field) {
    zpgs_strided strided = {field, sizeof(struct body)};
    return strided;
}

static int run(zpgs_accelerator *accelerator) {
    const zpgs_shape shapes[] = {{0.0f, {0.0f, 0.0f, 0.0f}}, {1.0f, {1.5f, 1.5f, 1.5f}}};
    struct body bodies[BODIES] = {
        {{0.0f, -1.0f, 0.0f}, {0.0f, 0.0f, 0.0f, 1.0f}, {0.0f}, {0.0f}, 0},
        {{0.0f, 2.0f, 0.0f}, {0.0f, 0.0f, 0.0f, 1.0f}, {0.5f, 0.0f, 0.0f}, {0.0f}, 1},
    };
    zpgs_bodies arrays;
    zpgs_collisions collisions;
    zpgs_parameters parameters;
    zpgs_report report;
    zpgs_status status;
    double seconds = 0.0;
    uint64_t digest = 0xcbf29ce484222325u;
    int i;

    memset(&arrays, 0, sizeof arrays);
    arrays.size = sizeof arrays;
    arrays.count = BODIES;
    arrays.positions = column(bodies[0].position);
    arrays.orientations = column(bodies[0].orientation);
    arrays.linear_velocities = column(bodies[0].linear_velocity);
    arrays.angular_velocities = column(bodies[0].angular_velocity);
    arrays.shapes.data = &bodies[0].shape;
    arrays.shapes.stride = sizeof bodies[0];

    status = zpgs_set_shapes(accelerator, shapes, 2);
    if (status != ZPGS_STATUS_OK) return failed(accelerator, "zpgs_set_shapes", status);
    status = zpgs_parameters_default(&parameters, sizeof parameters);
    if (status != ZPGS_STATUS_OK) return failed(NULL, "zpgs_parameters_default", status);
    parameters.friction = 0.5f;

    for (i = 0; i < STEPS; i++) {
        const zpgs_collision collision = collide(&bodies[CUBE]);
        memset(&collisions, 0, sizeof collisions);
        collisions.size = sizeof collisions;
        collisions.count = 1;
        collisions.collisions.data = &collision;
        collisions.collisions.stride = sizeof collision;
        report.size = sizeof report;
        if (i % 2 == 0) {
            status = zpgs_step(accelerator, &arrays, &collisions, &parameters, &report);
        } else {
            status = zpgs_submit(accelerator, &arrays, &collisions, &parameters);
            if (status != ZPGS_STATUS_OK) return failed(accelerator, "zpgs_submit", status);
            /* Sound, pictures, input, while the board works. */
            status = zpgs_wait(accelerator, &arrays, &report);
        }
        if (status != ZPGS_STATUS_OK) return failed(accelerator, "the step", status);
        seconds += report.seconds;
    }

    for (i = 0; i < BODIES; i++) {
        digest = fnv1a(digest, bodies[i].position, 3);
        digest = fnv1a(digest, bodies[i].orientation, 4);
        digest = fnv1a(digest, bodies[i].linear_velocity, 3);
        digest = fnv1a(digest, bodies[i].angular_velocity, 3);
    }
    printf("library    %s, interface %u\n", zpgs_version(), (unsigned)zpgs_abi_version());
    printf("time       %.3f ms for %d steps on the board (modelled)\n", 1000.0 * seconds, STEPS);
    printf("height     %.3f m\n", bodies[CUBE].position[1]);
    printf("digest     fnv1a-64 %016llx\n", (unsigned long long)digest);
    return 0;
}

int main(int count, char **arguments) {
    zpgs_accelerator *accelerator;
    const char *board = count > 1 ? arguments[1] : "emulated:float";
    int code;
    const zpgs_status status = zpgs_open(board, &accelerator);
    if (status != ZPGS_STATUS_OK) return failed(NULL, "zpgs_open", status);
    code = run(accelerator);
    zpgs_close(accelerator);
    return code;
}
