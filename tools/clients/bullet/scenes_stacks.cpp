// Piles, walls and towers.
#include <algorithm>
#include <random>

#include "table.h"

namespace {

// A thousand cubes of 1 kg fall from a loose grid.
std::vector<double> runPile(World &world, int run = 0) {
    world.addGround();
    Shifts shifts(run);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> shift(-0.1f, 0.1f);
    for (int y = 0; y < 10; y++)
        for (int x = 0; x < 10; x++)
            for (int z = 0; z < 10; z++) {
                const float atX = 1.2f * float(x) - 6 + shift(random);
                const float atZ = 1.2f * float(z) - 6 + shift(random);
                world.add(world.cube(), 1, btVector3(atX, 1 + 1.2f * float(y), atZ) + shifts.next());
            }
    world.step(300);
    return {world.kineticEnergy(), world.deepest(), double(world.asleep())};
}

btRigidBody *addTower(World &world, int cubes, float topMass, int run) {
    world.addGround();
    Shifts shifts(run);
    btRigidBody *top = nullptr;
    for (int y = 0; y < cubes; y++) {
        const btVector3 at = btVector3(0, 0.5f + float(y), 0) + shifts.next();
        top = world.add(world.cube(), y == cubes - 1 ? topMass : 1, at);
        top->setActivationState(DISABLE_DEACTIVATION);
    }
    return top;
}

// 1 if the tower stands after 10 s.
std::vector<double> runTower(World &world, int cubes, int run = 0) {
    const btRigidBody *top = addTower(world, cubes, 1, run);
    world.step(600);
    return {double(place(top).y() > float(cubes) - 1)};
}

std::vector<double> runRatio(World &world, int run = 0) {
    addTower(world, 2, 100, run);
    world.step(60);
    double deepest = 0;
    for (int i = 0; i < 240; i++) {
        world.step();
        deepest = std::fmax(deepest, world.deepest());
    }
    return {deepest};
}

// Runs of both solvers that are nearly equal; a run has several measures.
struct Runs {
    std::vector<std::vector<double>> bullet, board;
    void add(const Table::Both &both) {
        bullet.push_back(both.bullet);
        board.push_back(both.board);
    }
};

// A row: how many of the runs keep a limit with measure `index`; at least `least` must.
void addCount(Table &table, const Runs &runs, size_t index, const Limit &limit, const std::string &measure,
              const Limit &least = Limit()) {
    auto count = [&](const std::vector<std::vector<double>> &of) {
        return double(
            std::count_if(of.begin(), of.end(), [&](const auto &run) { return limit.holds(run[index]); }));
    };
    table.add(count(runs.bullet), count(runs.board), measure, "", least);
}

// A row: the median of measure `index`.
void addMedian(Table &table, const Runs &runs, size_t index, const std::string &measure) {
    auto median = [&](std::vector<std::vector<double>> of) {
        std::sort(of.begin(), of.end(),
                  [index](const auto &a, const auto &b) { return a[index] < b[index]; });
        return of[of.size() / 2][index];
    };
    table.add(median(runs.bullet), median(runs.board), measure, "mm");
}

}  // namespace

void pile(Table &table) {
    const auto few = table.measure(4, [](World &world) { return runPile(world); });
    table.add(few, 0, "4 + 4 passes: kinetic energy at step 300", "J", atMost(1));
    table.add(few, 1, "4 + 4 passes: deepest at step 300", "mm", atMost(30));
    table.add(few, 2, "4 + 4 passes: asleep at step 300", "");
    const auto many = table.measure(10, [](World &world) { return runPile(world); });
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

void tower(Table &table) {
    double highest[2] = {0, 0};
    bool stands[2] = {true, true};
    for (const int cubes : {3, 5, 8, 10, 12, 15, 20}) {
        const auto both = table.measure(10, [cubes](World &world) { return runTower(world, cubes); });
        stands[0] = stands[0] && both.bullet[0] > 0;
        stands[1] = stands[1] && both.board[0] > 0;
        for (int i = 0; i < 2; i++)
            if (stands[i]) highest[i] = cubes;
    }
    table.add(highest[0], highest[1], "cubes of the highest that stands 10 s", "", chaotic(atLeast(15)));
    Runs runs;
    for (int run = 0; run < 25; run++)
        runs.add(table.measure(10, [run](World &world) { return runTower(world, 15, run); }));
    addCount(table, runs, 0, atLeast(1), "of 25 nearly equal ones of 15 cubes: stand", atLeast(18));
}

void ratio(Table &table) {
    Runs runs;
    for (int run = 0; run < 25; run++)
        runs.add(table.measure(10, [run](World &world) { return runRatio(world, run); }));
    const Limit limit = chaotic(atMost(110));
    table.add(runs.bullet[0][0], runs.board[0][0], "deepest from 1 s to 5 s", "mm", limit);
    addCount(table, runs, 0, limit, "of this and 24 nearly equal runs: at most 110 mm");
    addMedian(table, runs, 0, "median of these");
}

void spread(Table &table) {
    Runs piles;
    for (int run = 0; run < 9; run++)
        piles.add(table.measure(4, [run](World &world) { return runPile(world, run); }));
    addCount(table, piles, 0, atMost(1), "of 9 piles, 4 + 4 passes: at most 1 J");
    addCount(table, piles, 1, atMost(30), "of 9 piles: at most 30 mm deep");
    addMedian(table, piles, 1, "median of the depths");
    for (const int cubes : {10, 12, 15, 17}) {
        Runs towers;
        for (int run = 0; run < 9; run++)
            towers.add(table.measure(10, [run, cubes](World &world) { return runTower(world, cubes, run); }));
        addCount(table, towers, 0, atLeast(1),
                 "of 9 towers of " + std::to_string(cubes) + " cubes: stand 10 s");
    }
}
