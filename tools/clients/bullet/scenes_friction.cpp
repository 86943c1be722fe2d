// Sliding, rolling and spinning.
#include "table.h"

namespace {
const btVector3 ACROSS(0, 0, 1);
}

void ramp(Table &table) {
    const auto both = table.measure(10, [](World &world) -> std::vector<double> {
        const btQuaternion turn(ACROSS, 20 * SIMD_RADS_PER_DEG);
        world.add(world.shape<btBoxShape>(btVector3(20, 0.5f, 20)), 0, btVector3(0, 0, 0), 1, turn);
        std::vector<btRigidBody *> boxes;
        std::vector<btVector3> starts;
        for (const float friction : {0.1f, 0.3f, 0.5f, 0.9f}) {
            starts.push_back(quatRotate(turn, btVector3(5, 1, 2 * float(starts.size()))));
            boxes.push_back(world.add(world.cube(), 1, starts.back(), friction, turn));
            boxes.back()->setActivationState(DISABLE_DEACTIVATION);
        }
        world.step(120);
        std::vector<double> slid;
        for (size_t i = 0; i < boxes.size(); i++) slid.push_back((place(boxes[i]) - starts[i]).length());
        return slid;
    });
    // g t^2 (sin 20 - friction cos 20) / 2 is 4.86, 1.18, 0 and 0 m. Steps of 1/60 s and the first
    // penetration add some centimetres.
    table.add(both, 0, "slid in 2 s, friction 0.1", "m", within(4.62, 5.15));
    table.add(both, 1, "slid in 2 s, friction 0.3", "m", within(1.12, 1.37));
    table.add(both, 2, "slid in 2 s, friction 0.5", "m", atMost(0.02));
    table.add(both, 3, "slid in 2 s, friction 0.9", "m", atMost(0.02));
}

void groove(Table &table) {
    const auto both = table.measure(10, [](World &world) -> std::vector<double> {
        auto *plane = world.shape<btBoxShape>(btVector3(5, 0.5f, 100));
        for (const float side : {-1.0f, 1.0f}) {
            const btQuaternion turn(ACROSS, side * SIMD_PI / 4);
            world.add(plane, 0, quatRotate(turn, btVector3(0, -0.5f, 0)), 1, turn);
        }
        btRigidBody *marble =
            world.add(world.shape<btSphereShape>(0.5f), 1, btVector3(0, 0.5f / SIMDSQRT12, 0), 0.5f);
        marble->setLinearVelocity(btVector3(0, 0, 3));
        // It rolls on two points, each radius / sqrt(2) from the axis.
        marble->setAngularVelocity(btVector3(3 / (0.5f * SIMDSQRT12), 0, 0));
        marble->setActivationState(DISABLE_DEACTIVATION);
        world.step(30);
        const double half = marble->getLinearVelocity().z();
        world.step(90);
        return {half, marble->getLinearVelocity().z()};
    });
    table.add(both, 0, "speed after 0.5 s, from 3 m/s", "m/s", atLeast(2.6));
    table.add(both, 1, "speed after 2 s", "m/s");
}

void spin(Table &table) {
    const auto both = table.measure(10, [](World &world) -> std::vector<double> {
        world.addGround(1);
        auto *sphere = world.shape<btSphereShape>(0.5f);
        btRigidBody *bodies[] = {world.add(world.cube(), 1, btVector3(0, 0.5f, 0)),
                                 world.add(sphere, 1, btVector3(5, 0.5f, 0)),
                                 world.add(sphere, 1, btVector3(8, 0.515f, 0))};
        std::vector<double> left;
        for (btRigidBody *body : bodies) {
            body->setAngularVelocity(btVector3(0, 10, 0));
            body->setActivationState(DISABLE_DEACTIVATION);
        }
        bodies[2]->setGravity(btVector3(0, 0, 0));
        world.step(60);
        for (const btRigidBody *body : bodies) left.push_back(body->getAngularVelocity().y());
        return left;
    });
    table.add(both, 0, "box on the ground, friction 0.5: after 1 s", "rad/s");
    table.add(both, 1, "ball on the ground: after 1 s", "rad/s");
    table.add(both, 2, "ball 15 mm above the ground: after 1 s", "rad/s", within(9.999, 10.001));

    const auto flight = table.measure(10, [](World &world) -> std::vector<double> {
        world.bullet().setGravity(btVector3(0, 0, 0));
        btRigidBody *handle = world.add(world.cube(), 1, btVector3(0, 0, 0));
        handle->setMassProps(1, btVector3(0.1f, 0.2f, 0.3f));
        handle->updateInertiaTensor();
        handle->setAngularVelocity(btVector3(0.01f, 5, 0));
        handle->setActivationState(DISABLE_DEACTIVATION);
        double flips = 0;
        btScalar side = 1;
        for (int i = 0; i < 1200; i++) {
            world.step();
            if (handle->getWorldTransform().getBasis()[1][1] * side > -0.5f) continue;
            side = -side;
            flips++;
        }
        return {flips};
    });
    // The gyroscopic term turns it over; it flies free, so both solvers do the same.
    table.add(flight, 0, "flips in 20 s about the middle axis of inertia", "",
              within(flight.bullet[0], flight.bullet[0]));
}
