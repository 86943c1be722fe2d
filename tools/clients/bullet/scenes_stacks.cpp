// Piles, walls and towers.
#include <random>

#include "table.h"

namespace {

// A thousand cubes of 1 kg fall from a loose grid.
void addPile(World &world) {
    world.addGround();
    std::mt19937 random(1);
    std::uniform_real_distribution<float> shift(-0.1f, 0.1f);
    for (int y = 0; y < 10; y++)
        for (int x = 0; x < 10; x++)
            for (int z = 0; z < 10; z++) {
                const float atX = 1.2f * float(x) - 6 + shift(random);
                const float atZ = 1.2f * float(z) - 6 + shift(random);
                world.add(world.cube(), 1, btVector3(atX, 1 + 1.2f * float(y), atZ));
            }
}

std::vector<double> runPile(World &world) {
    addPile(world);
    world.step(300);
    return {world.kineticEnergy(), world.deepest(), double(world.asleep())};
}

btRigidBody *addTower(World &world, int cubes, float topMass) {
    world.addGround();
    btRigidBody *top = nullptr;
    for (int y = 0; y < cubes; y++) {
        top = world.add(world.cube(), y == cubes - 1 ? topMass : 1, btVector3(0, 0.5f + float(y), 0));
        top->setActivationState(DISABLE_DEACTIVATION);
    }
    return top;
}

}  // namespace

void pile(Table &table) {
    const auto few = table.measure(4, runPile);
    table.add(few, 0, "4 + 4 passes: kinetic energy at step 300", "J", warm(atMost(1)));
    table.add(few, 1, "4 + 4 passes: deepest at step 300", "mm", warm(atMost(30)));
    table.add(few, 2, "4 + 4 passes: asleep at step 300", "");
    const auto many = table.measure(10, runPile);
    table.add(many, 0, "10 + 10 passes: kinetic energy at step 300", "J");
    table.add(many, 1, "10 + 10 passes: deepest at step 300", "mm");
    table.add(many, 2, "10 + 10 passes: asleep at step 300", "");
}

void wall(Table &table) {
    const auto both = table.measure(10, [](World &world) -> std::vector<double> {
        world.addGround();
        auto *brick = world.shape<btBoxShape>(btVector3(0.5f, 0.25f, 0.25f));
        std::vector<btRigidBody *> bricks;
        std::vector<btVector3> places;
        for (int y = 0; y < 8; y++)
            for (int x = 0; x < 10; x++) {
                const float shift = y % 2 ? 0.25f : 0.0f;
                places.push_back(btVector3(float(x) - 5 + shift, 0.25f + 0.5f * float(y), 0));
                bricks.push_back(world.add(brick, 2, places.back()));
            }
        world.step(120);
        double moved = 0;
        for (size_t i = 0; i < bricks.size(); i++)
            moved = std::fmax(moved, (place(bricks[i]) - places[i]).length());
        btRigidBody *ball = world.add(world.shape<btSphereShape>(0.5f), 20, btVector3(0, 2, 12));
        ball->setLinearVelocity(btVector3(0, 0, -20));
        world.step(60);
        int fallen = 0;
        for (size_t i = 0; i < bricks.size(); i++) fallen += place(bricks[i]).y() < places[i].y() - 0.2f;
        return {1e3 * moved, -ball->getLinearVelocity().z(), double(fallen)};
    });
    table.add(both, 0, "the brick that moved most in 2 s", "mm");
    table.add(both, 1, "the ball's speed 1 s after its shot at 20 m/s", "m/s");
    table.add(both, 2, "bricks that fell by then, of 80", "");
}

void mixed(Table &table) {
    const auto both = table.measure(10, [](World &world) -> std::vector<double> {
        world.addGround();
        std::vector<btCollisionShape *> shapes;
        for (const float size : {0.3f, 0.4f, 0.5f}) {
            shapes.push_back(world.shape<btSphereShape>(size));
            shapes.push_back(world.shape<btCapsuleShape>(0.6f * size, size));
            shapes.push_back(world.shape<btBoxShape>(btVector3(size, 0.5f * size, 0.8f * size)));
            shapes.push_back(world.shape<btCylinderShape>(btVector3(0.7f * size, size, 0.7f * size)));
        }
        const float masses[] = {0.5f, 1, 2, 4};
        std::mt19937 random(2);
        std::uniform_real_distribution<float> shift(-0.2f, 0.2f);
        for (size_t i = 0; i < 288; i++) {
            const float atX = 1.3f * float(i / 6 % 6) - 4 + shift(random);
            const float atZ = 1.3f * float(i % 6) - 4 + shift(random);
            world.add(shapes[i % 12], masses[i / 12 % 4], btVector3(atX, 1 + 1.3f * float(i / 36), atZ));
        }
        world.step(400);
        double lowest = 0;
        for (const auto &body : world.bodies())
            if (body->getInvMass() > 0) lowest = std::fmin(lowest, place(body.get()).y());
        return {world.kineticEnergy(), world.deepest(), lowest};
    });
    table.add(both, 0, "kinetic energy at step 400", "J");
    table.add(both, 1, "deepest at step 400", "mm");
    table.add(both, 2, "lowest centre below the ground", "m", atLeast(-0.05));
}

void tower(Table &table) {
    double highest[2] = {0, 0};
    bool stands[2] = {true, true};
    for (const int cubes : {3, 5, 8, 10, 12, 15, 20}) {
        const auto both = table.measure(10, [cubes](World &world) -> std::vector<double> {
            const btRigidBody *top = addTower(world, cubes, 1);
            world.step(600);
            return {double(place(top).y() > float(cubes) - 1)};
        });
        stands[0] = stands[0] && both.bullet[0] > 0;
        stands[1] = stands[1] && both.board[0] > 0;
        for (int i = 0; i < 2; i++)
            if (stands[i]) highest[i] = cubes;
    }
    table.add(highest[0], highest[1], "cubes of the highest that stands 10 s", "", warm(atLeast(15)));
}

void ratio(Table &table) {
    const auto both = table.measure(10, [](World &world) -> std::vector<double> {
        addTower(world, 2, 100);
        world.step(60);
        double deepest = 0;
        for (int i = 0; i < 240; i++) {
            world.step();
            deepest = std::fmax(deepest, world.deepest());
        }
        return {deepest};
    });
    table.add(both, 0, "deepest from 1 s to 5 s", "mm", warm(atMost(110)));
}
