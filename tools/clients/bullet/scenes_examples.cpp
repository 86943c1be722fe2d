// Scenes as in Bullet's example browser: boxes, compounds, pyramids and a heightfield.
#include <BulletCollision/CollisionShapes/btHeightfieldTerrainShape.h>

#include "table.h"

namespace {

const btVector3 UP(0, 1, 0);

void addFloor(World &world) {
    world.bullet().setGravity(btVector3(0, -10, 0));
    world.add(world.shape<btBoxShape>(btVector3(100, 50, 100)), 0, btVector3(0, -50, 0));
}

// A block of 125 boxes of 0.2 m, side on side, falls 2 m. Then a ball falls on them.
std::vector<double> runBasic(World &world) {
    addFloor(world);
    auto *box = world.shape<btBoxShape>(btVector3(0.1f, 0.1f, 0.1f));
    for (int i = 0; i < 125; i++)
        world.add(box, 1, btVector3(float(i % 5), 10 + float(i / 25), float(i / 5 % 5)) * 0.2f);
    world.step(300);
    std::vector<double> found = {world.kineticEnergy(), world.deepest()};
    world.step(600);
    found.push_back(world.asleep());
    btRigidBody *ball = world.add(world.shape<btSphereShape>(0.2f), 5, btVector3(0.4f, 4, 0.4f));
    ball->setLinearVelocity(btVector3(0, -10, 0));
    world.step(60);
    found.push_back(world.asleep());
    return found;
}

// A plate with a block on it and a rod below, as one body that falls turned.
std::vector<double> runCompound(World &world) {
    addFloor(world);
    auto *compound = world.shape<btCompoundShape>();
    const btQuaternion straight = btQuaternion::getIdentity();
    const btVector3 halves[] = {{1, 0.1f, 0.6f}, {0.3f, 0.4f, 0.3f}, {0.1f, 0.5f, 0.1f}};
    const btVector3 places[] = {{0, 0, 0}, {0.5f, 0.5f, 0}, {-0.6f, -0.6f, 0.2f}};
    for (int i = 0; i < 3; i++)
        compound->addChildShape(btTransform(straight, places[i]), world.shape<btBoxShape>(halves[i]));
    btScalar masses[] = {2, 1, 0.5f};
    btTransform principal;
    btVector3 inertia;
    compound->calculatePrincipalAxisTransform(masses, principal, inertia);
    auto *centred = world.shape<btCompoundShape>();
    for (int i = 0; i < 3; i++)
        centred->addChildShape(principal.inverse() * compound->getChildTransform(i),
                               compound->getChildShape(i));
    btRigidBody *body = world.add(centred, 3.5f, btVector3(0, 4, 0), 0.5f, btQuaternion(UP, 0.3f));
    body->setMassProps(3.5f, inertia);
    body->updateInertiaTensor();
    world.step(600);
    return {double(world.asleep()), place(body).y()};
}

// A pyramid of 12 storeys, three walls and a round tower: 1,076 boxes of 2 m.
std::vector<double> runPyramids(World &world) {
    addFloor(world);
    auto *box = world.shape<btBoxShape>(btVector3(1, 1, 1));
    std::vector<btRigidBody *> boxes;
    const int storeys = 12;
    const float gap = 2.1f;
    auto add = [&](const btVector3 &at, const btQuaternion &turn = btQuaternion::getIdentity()) {
        boxes.push_back(world.add(box, 1, at, 0.5f, turn));
    };
    for (int y = 0; y < storeys; y++) {
        const int edge = storeys - y;
        const float first = -0.5f * float(edge - 1) * gap, height = 1 + 2 * float(y);
        for (int i = 0; i < edge * edge; i++)
            add(btVector3(-30 + first + gap * float(i % edge), height, first + gap * float(i / edge)));
        for (int wall = 0; wall < 3; wall++)
            for (int i = 0; i < edge; i++) add(btVector3(6 * float(wall), height, first + gap * float(i)));
    }
    // Every second ring of the tower is turned by half a box.
    for (int y = 0; y < 8; y++)
        for (int i = 0; i < 24; i++) {
            const btQuaternion turn(UP, SIMD_2_PI * (float(i) + 0.5f * float(y % 2)) / 24);
            add(btVector3(40, 0, 0) + quatRotate(turn, btVector3(0, 1 + 2 * float(y), 9.5f)), turn);
        }
    std::vector<btVector3> starts;
    for (const btRigidBody *one : boxes) starts.push_back(place(one));
    world.step(200);
    const double asleep = world.asleep(), deepest = world.deepest();
    world.step(400);
    double moved = 0;
    for (size_t i = 0; i < boxes.size(); i++)
        moved = std::fmax(moved, (place(boxes[i]) - starts[i]).length());
    return {asleep, deepest, double(world.asleep()), 1e3 * moved};
}

// 200 spheres, capsules, boxes, compounds and cylinders fall on hills.
std::vector<double> runHeightfield(World &world) {
    const int edge = 65;
    static std::vector<float> heights;
    heights.clear();
    for (int i = 0; i < edge * edge; i++)
        heights.push_back(std::sin(0.4f * float(i % edge)) * std::cos(0.3f * float(i / edge)));
    world.bullet().setGravity(btVector3(0, -10, 0));
    // Its origin is the centre, half way between its lowest and its highest point.
    auto *hills = world.shape<btHeightfieldTerrainShape>(edge, edge, heights.data(), 1.0f, -1.0f, 1.0f, 1,
                                                         PHY_FLOAT, false);
    world.add(hills, 0, btVector3(0, 0, 0), 1);
    auto *dumbbell = world.shape<btCompoundShape>();
    for (const float side : {-0.4f, 0.4f})
        dumbbell->addChildShape(btTransform(btQuaternion::getIdentity(), btVector3(side, 0, 0)),
                                world.shape<btSphereShape>(0.3f));
    btCollisionShape *shapes[] = {world.shape<btSphereShape>(0.5f), world.shape<btCapsuleShape>(0.3f, 0.6f),
                                  world.shape<btBoxShape>(btVector3(0.5f, 0.3f, 0.4f)), dumbbell,
                                  world.shape<btCylinderShape>(btVector3(0.4f, 0.5f, 0.4f))};
    std::vector<btRigidBody *> bodies;
    for (int i = 0; i < 200; i++) {
        const btVector3 grid(float(i % 10), float(i / 100), float(i / 10 % 10));
        bodies.push_back(world.add(shapes[i % 5], 1, 1.5f * grid + btVector3(-7, 3, -7), 1));
    }
    world.step(600);
    int through = 0;
    for (const btRigidBody *body : bodies) through += place(body).y() < -1.2f;
    return {world.kineticEnergy(), world.deepest(), double(through)};
}

}  // namespace

void basic(Table &table) {
    const auto both = table.measure(10, runBasic);
    table.add(both, 0, "kinetic energy at step 300", "J", atMost(1));
    table.add(both, 1, "deepest at step 300", "mm", atMost(20));
    table.add(both, 2, "asleep after 15 s, of 125", "", within(125, 125));
    table.add(both, 3, "still asleep 1 s after a ball fell on them", "", atMost(60));
}

void compound(Table &table) {
    const auto both = table.measure(10, runCompound);
    table.add(both, 0, "asleep after 10 s, of 1", "", within(1, 1));
    const double height = both.bullet[1];
    table.add(both, 1, "height of its centre then", "m", within(height - 0.02, height + 0.02));
}

void pyramids(Table &table) {
    const auto both = table.measure(10, runPyramids);
    table.add(both, 0, "asleep at step 200, of 1,076", "", within(1076, 1076));
    table.add(both, 1, "deepest at step 200", "mm", atMost(20));
    table.add(both, 2, "asleep at step 600, of 1,076", "", within(1076, 1076));
    table.add(both, 3, "the box that moved most in 10 s", "mm", atMost(100));
}

void heightfield(Table &table) {
    const auto both = table.measure(10, runHeightfield);
    table.add(both, 0, "kinetic energy after 10 s", "J", atMost(50));
    table.add(both, 1, "deepest then", "mm", atMost(45));
    table.add(both, 2, "bodies that fell through, of 200", "", within(0, 0));
}
