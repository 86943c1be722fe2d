// Platforms, bounces, meshes and speed.
#include "table.h"

namespace {

// Cycles of the board in a step of 200 boxes, the mean over the last half second. They lie on the ground, or
// on a platform at 1 m/s.
double cyclesOfBoxes(World &world, bool onPlatform) {
    btRigidBody *platform = nullptr;
    if (onPlatform)
        platform = world.addPlatform(btVector3(30, 0.25f, 30));
    else
        world.addGround();
    for (int i = 0; i < 200; i++) {
        const btVector3 at(1.5f * float(i % 15) - 11, 0.5f, 1.5f * float(i / 15) - 11);
        world.add(world.cube(), 1, at)->setActivationState(DISABLE_DEACTIVATION);
    }
    double cycles = 0;
    for (int i = 0; i < 60; i++) {
        if (platform) world.move(platform, btVector3(float(i + 1) / 60, -0.25f, 0));
        world.step();
        if (i >= 30 && world.board()) cycles += double(world.board()->counts().report.cycles) / 30;
    }
    return world.board() ? cycles : NONE;
}

}  // namespace

void platform(Table &table) {
    const auto box = table.measure(10, [](World &world) -> std::vector<double> {
        btRigidBody *platform = world.addPlatform(btVector3(3, 0.25f, 3));
        btRigidBody *rider = world.add(world.cube(), 1, btVector3(0, 0.51f, 0));
        rider->setActivationState(DISABLE_DEACTIVATION);
        for (int i = 1; i <= 120; i++) {
            world.move(platform, btVector3(float(i) / 60, -0.25f, 0));
            world.step();
        }
        return {place(platform).x() - place(rider).x()};
    });
    // Friction 0.25 takes 0.41 s to bring the box to 1 m/s, in which it loses 0.20 m.
    table.add(box, 0, "box left behind, platform at 1 m/s for 2 s", "m", within(0.19, 0.215));
    const auto cycles =
        table.measure(10, [](World &world) -> std::vector<double> { return {cyclesOfBoxes(world, true)}; });
    const auto ground =
        table.measure(10, [](World &world) -> std::vector<double> { return {cyclesOfBoxes(world, false)}; });
    table.add(ground, 0, "200 boxes on the ground: cycles of a step", "");
    table.add(cycles, 0, "200 boxes on a platform at 1 m/s: cycles of a step", "");
    table.add(NONE, cycles.board[0] / ground.board[0], "ratio of the two", "", atMost(1.1));
}

void restitution(Table &table) {
    const auto both = table.measure(10, [](World &world) -> std::vector<double> {
        world.addGround()->setRestitution(1);
        btRigidBody *ball = world.add(world.shape<btSphereShape>(0.5f), 1, btVector3(0, 5.5f, 0));
        ball->setRestitution(0.8f);
        ball->setActivationState(DISABLE_DEACTIVATION);
        std::vector<double> apexes;
        double last = 10;
        bool rises = false;
        for (int i = 0; i < 600; i++) {
            world.step();
            const double height = place(ball).y() - 0.5;
            if (rises && height < last) apexes.push_back(last);
            rises = height > last;
            last = height;
        }
        apexes.resize(3, 0);
        return apexes;
    });
    // 5 m times 0.64, 0.64^2, 0.64^3, and 5 % for the step of 1/60 s.
    table.add(both, 0, "first apex, exact 3.20", "m", within(3.04, 3.36));
    table.add(both, 1, "second apex, exact 2.05", "m", within(1.94, 2.16));
    table.add(both, 2, "third apex, exact 1.31", "m", within(1.24, 1.38));
}

void mesh(Table &table) {
    const auto both = table.measure(10, [](World &world) -> std::vector<double> {
        btTriangleMesh *ground = world.mesh();
        auto corner = [](int i, int j) {
            const float height = 0.6f * std::sin(0.9f * float(i)) * std::cos(0.7f * float(j));
            return btVector3(float(i) - 10, height, float(j) - 10);
        };
        for (int i = 0; i < 20; i++)
            for (int j = 0; j < 20; j++) {
                ground->addTriangle(corner(i, j), corner(i, j + 1), corner(i + 1, j));
                ground->addTriangle(corner(i + 1, j), corner(i, j + 1), corner(i + 1, j + 1));
            }
        world.add(world.shape<btBvhTriangleMeshShape>(ground, true), 0, btVector3(0, 0, 0), 1);
        auto *box = world.shape<btBoxShape>(btVector3(0.4f, 0.2f, 0.3f));
        auto *ball = world.shape<btSphereShape>(0.3f);
        std::vector<btRigidBody *> bodies;
        for (int i = 0; i < 120; i++) {
            const btVector3 at(1.1f * float(i % 8) - 4, 2 + float(i / 64), 1.1f * float(i / 8 % 8) - 4);
            btCollisionShape *shape = ball;
            if (i % 2) shape = box;
            bodies.push_back(world.add(shape, 1, at));
        }
        world.step(300);
        int through = 0;
        for (const btRigidBody *body : bodies) {
            const btVector3 &at = place(body);
            const bool above = std::fabs(at.x()) < 9.5f && std::fabs(at.z()) < 9.5f;
            through += above && at.y() < -0.8f;
        }
        return {double(through), world.deepest(), world.kineticEnergy()};
    });
    table.add(both, 0, "bodies that fell through, of 120", "", within(0, 0));
    table.add(both, 1, "deepest at step 300", "mm");
    table.add(both, 2, "kinetic energy at step 300", "J");
}

void ccd(Table &table) {
    const auto both = table.measure(10, [](World &world) -> std::vector<double> {
        world.bullet().setGravity(btVector3(0, 0, 0));
        world.add(world.shape<btBoxShape>(btVector3(0.05f, 5, 5)), 0, btVector3(0, 0, 0));
        btRigidBody *ball = world.add(world.shape<btSphereShape>(0.1f), 1, btVector3(-5.3f, 0, 0));
        ball->setLinearVelocity(btVector3(100, 0, 0));
        ball->setCcdMotionThreshold(0.05f);
        ball->setCcdSweptSphereRadius(0.08f);
        world.step(30);
        return {place(ball).x()};
    });
    table.add(both, 0, "ball at 100 m/s, wall of 0.1 m at 0: its place", "m", atMost(0));
}
