// Drops cubes on each other on the emulated board, each step with the impulses of the last one, and prints
// the digest of the bodies.
//
// Build: c++ -std=c++17 tower.cpp $(pkg-config --cflags --libs zynq-pgs) -o tower
#include <array>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <vector>

#include "zynq_pgs.hpp"

namespace {

// The program's own body: the library reads and writes its fields where they lie.
struct Body {
    std::array<float, 3> position;
    std::array<float, 4> orientation;
    std::array<float, 3> linear_velocity, angular_velocity;
    std::uint32_t shape;
};

constexpr int CUBES = 4, STEPS = 90;
// The half length of the edges of all bodies, m.
constexpr float HALF = 0.5f;
// The share of the last step's impulses that a step begins with.
constexpr float KEPT = 0.85f;

// A ground, and cubes above it with gaps between them. The one on top also moves sideways.
std::vector<Body> tower() {
    std::vector<Body> bodies{{{0, -HALF, 0}, {0, 0, 0, 1}, {}, {}, 0}};
    for (int cube = 0; cube < CUBES; cube++) {
        const float height = HALF + 1.125f * static_cast<float>(cube);
        bodies.push_back({{0, height, 0}, {0, 0, 0, 1}, {}, {}, 1});
    }
    bodies.back().linear_velocity[0] = 0.25f;
    return bodies;
}

// The collision of two cubes, one on the other; empty if they do not touch. A turned cube would touch
// elsewhere; the cubes below hardly turn.
zpgs_collision collide(const std::vector<Body> &bodies, std::uint32_t below) {
    const std::array<float, 3> &lower = bodies[below].position, &upper = bodies[below + 1].position;
    zpgs_collision collision{};
    collision.body_a = below + 1;
    collision.body_b = below;
    collision.normal[1] = 1; // from the lower one to the upper one
    const float distance = upper[1] - lower[1] - 2 * HALF;
    if (distance >= 0) return collision;
    for (const float x : {-HALF, HALF}) {
        for (const float z : {-HALF, HALF}) {
            zpgs_contact &contact = collision.contacts[collision.count++];
            contact.point[0] = upper[0] + x;
            contact.point[1] = lower[1] + HALF;
            contact.point[2] = upper[2] + z;
            contact.distance = distance;
        }
    }
    return collision;
}

void warm(zpgs_impulses &impulses) {
    for (float &impulse : impulses.normal) impulse *= KEPT;
    for (float &impulse : impulses.friction) impulse *= KEPT;
}

zpgs_bodies arrays(std::vector<Body> &bodies) {
    const auto column = [](auto &field) { return zpgs_strided{field.data(), sizeof(Body)}; };
    zpgs_bodies arrays{};
    arrays.size = sizeof arrays;
    arrays.count = bodies.size();
    arrays.positions = column(bodies[0].position);
    arrays.orientations = column(bodies[0].orientation);
    arrays.linear_velocities = column(bodies[0].linear_velocity);
    arrays.angular_velocities = column(bodies[0].angular_velocity);
    arrays.shapes = {&bodies[0].shape, sizeof(Body)};
    return arrays;
}

template <std::size_t N> void fnv1a(std::uint64_t &digest, const std::array<float, N> &numbers) {
    for (const float number : numbers) {
        std::uint32_t bits;
        std::memcpy(&bits, &number, sizeof bits);
        for (int shift = 0; shift < 32; shift += 8)
            digest = (digest ^ ((bits >> shift) & 0xff)) * 0x100000001b3u;
    }
}

void run(const char *board) {
    zpgs::Accelerator accelerator(board);
    accelerator.set_shapes({{0, {0, 0, 0}}, {1, {6, 6, 6}}});
    std::vector<Body> bodies = tower();
    std::vector<zpgs_impulses> impulses(CUBES);
    zpgs_parameters parameters = zpgs::default_parameters();
    parameters.warm_start = parameters.impulses_out = 1;

    double seconds = 0;
    for (int step = 0; step < STEPS; step++) {
        accelerator.begin();
        for (std::uint32_t below = 0; below < CUBES; below++) {
            warm(impulses[below]);
            accelerator.push(collide(bodies, below), impulses[below]);
        }
        const zpgs_bodies columns = arrays(bodies);
        accelerator.end(columns, parameters);
        // Sound, pictures, input, while the board works.
        seconds += accelerator.wait(columns).seconds;
        accelerator.read_impulses(impulses);
    }

    std::uint64_t digest = 0xcbf29ce484222325u;
    for (const Body &body : bodies) {
        fnv1a(digest, body.position);
        fnv1a(digest, body.orientation);
        fnv1a(digest, body.linear_velocity);
        fnv1a(digest, body.angular_velocity);
    }
    std::printf("library    %s, interface %u\n", zpgs_version(), zpgs_abi_version());
    std::printf("time       %.3f ms for %d steps on the board (modelled)\n", 1000 * seconds, STEPS);
    std::printf("height     %.3f m\n", bodies.back().position[1]);
    std::printf("digest     fnv1a-64 %016llx\n", static_cast<unsigned long long>(digest));
}

}  // namespace

int main(int count, char **arguments) {
    try {
        run(count > 1 ? arguments[1] : "emulated:float");
    } catch (const zpgs::Error &error) {
        std::fprintf(stderr, "status %d: %s\n", static_cast<int>(error.status()), error.what());
        return 1;
    }
    return 0;
}
