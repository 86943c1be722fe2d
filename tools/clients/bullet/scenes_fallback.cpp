// Steps that Bullet's own solver takes, masses beyond the table of the board, and worlds that share one.
#include <iterator>

#include "table.h"

namespace {

// A doll of eleven capsules and ten joints, its feet at `at`.
void addRagdoll(World &world, const btVector3 &at) {
    struct Part {
        float radius, length;  // m, without the round ends
        btVector3 centre, joint;
        int parent;
    };
    const btVector3 none(0, 0, 0);
    // The trunk, then head, legs and arms.
    static const Part PARTS[] = {
        {0.15f, 0.20f, {0, 1.0f, 0}, none, -1},
        {0.15f, 0.28f, {0, 1.45f, 0}, {0, 1.2f, 0}, 0},
        {0.10f, 0.05f, {0, 1.85f, 0}, {0, 1.75f, 0}, 1},
        {0.07f, 0.40f, {0.11f, 0.62f, 0}, {0.11f, 0.85f, 0}, 0},
        {0.05f, 0.32f, {0.11f, 0.21f, 0}, {0.11f, 0.4f, 0}, 3},
        {0.07f, 0.40f, {-0.11f, 0.62f, 0}, {-0.11f, 0.85f, 0}, 0},
        {0.05f, 0.32f, {-0.11f, 0.21f, 0}, {-0.11f, 0.4f, 0}, 5},
        {0.05f, 0.28f, {0.26f, 1.4f, 0}, {0.26f, 1.6f, 0}, 1},
        {0.04f, 0.20f, {0.26f, 1.05f, 0}, {0.26f, 1.2f, 0}, 7},
        {0.05f, 0.28f, {-0.26f, 1.4f, 0}, {-0.26f, 1.6f, 0}, 1},
        {0.04f, 0.20f, {-0.26f, 1.05f, 0}, {-0.26f, 1.2f, 0}, 9},
    };
    btRigidBody *bodies[std::size(PARTS)];
    for (size_t i = 0; i < std::size(PARTS); i++) {
        const Part &part = PARTS[i];
        auto *capsule = world.shape<btCapsuleShape>(part.radius, part.length);
        bodies[i] = world.add(capsule, 1, at + part.centre);
        if (part.parent < 0) continue;
        const btVector3 inParent = part.joint - PARTS[part.parent].centre;
        world.join(bodies[part.parent], bodies[i], inParent, part.joint - part.centre);
    }
}

// 136 dolls in rows of 16, 15 ... 1: the height of the highest part, and the counts of the board.
std::vector<double> runRagdolls(World &world, bool withBoxes) {
    world.addGround();
    for (int row = 16; row > 0; row--)
        for (int i = 0; i < row; i++)
            addRagdoll(world, 1.5f * btVector3(float(i) - 0.5f * float(row), 0, float(16 - row)));
    const size_t dolls = world.bodies().size();
    for (int i = 0; withBoxes && i < 8; i++)
        world.add(world.cube(), 1, btVector3(2 * float(i), 0.5f, -20));
    world.step(120);
    double highest = 0;
    for (size_t i = 1; i < dolls; i++) highest = std::fmax(highest, place(world.bodies()[i].get()).y());
    const ZynqPgsCounts counts = world.board() ? world.board()->counts() : ZynqPgsCounts();
    return {highest, double(counts.boardSteps), world.kineticEnergy()};
}

// A heap of 60 bodies; each kind has shapes of its own.
void addHeap(World &world, int kind) {
    world.addGround();
    btCollisionShape *ball = world.shape<btSphereShape>(0.4f);
    for (int i = 0; i < 60; i++) {
        const btVector3 grid(float(i % 3) + 0.1f * float(i % 2), 1 + float(i / 9), float(i / 3 % 3));
        world.add(kind ? ball : world.cube(), 1 + 2 * float(kind), 1.1f * grid);
    }
}

void addPlaces(const World &world, std::vector<btVector3> &places) {
    for (const auto &body : world.bodies()) places.push_back(place(body.get()));
}

// Two worlds on one board in turn, and each alone: how many of their bodies lie elsewhere, and the steps
// of the board and its openings.
std::vector<double> runWorlds(const Settings &settings, ZynqPgsOptions options, bool byPlace) {
    options.byPlace = byPlace;
    const int steps = 300, passes = 10;
    std::vector<btVector3> shared, alone;
    const auto board = std::make_shared<ZynqPgsBoard>(settings.board.c_str());
    World cubes(board, options, passes), balls(board, options, passes);
    addHeap(cubes, 0);
    addHeap(balls, 1);
    for (int i = 0; i < steps; i++) {
        cubes.step();
        balls.step();
    }
    for (World *world : {&cubes, &balls}) addPlaces(*world, shared);
    for (const int kind : {0, 1}) {
        World world(settings.board, options, passes);
        addHeap(world, kind);
        world.step(steps);
        addPlaces(world, alone);
    }
    double elsewhere = 0;
    for (size_t i = 0; i < shared.size(); i++) elsewhere += !(shared[i] == alone[i]);
    const double taken = double(cubes.board()->counts().boardSteps + balls.board()->counts().boardSteps);
    return {elsewhere, taken, double(board->openings)};
}

}  // namespace

void worlds(Table &table) {
    for (const bool byPlace : {false, true}) {
        const auto found = runWorlds(table.settings(), table.settings().solver, byPlace);
        const std::string way = byPlace ? "impulses by place: " : "impulses by value: ";
        table.add(NONE, found[0], way + "bodies elsewhere than alone", "", within(0, 0));
        table.add(NONE, found[1], way + "steps that the board took", "", atLeast(400));
        table.add(NONE, found[2], way + "times that it was opened", "", within(1, 1));
    }
}

void ragdolls(Table &table) {
    const auto alone = table.measure(10, [](World &world) { return runRagdolls(world, false); });
    const double highest = alone.bullet[0];
    table.add(alone, 0, "height of the highest part after 2 s", "m", within(highest - 0.01, highest + 0.01));
    table.add(alone, 2, "kinetic energy then", "J");
    table.add(NONE, alone.board[1], "steps of 120 that the board solved: joints", "", within(0, 0));
    const auto beside = table.measure(10, [](World &world) { return runRagdolls(world, true); });
    table.add(NONE, beside.board[1], "the same with eight boxes beside: their contacts", "", within(120, 120));
}

void masses(Table &table) {
    const auto both = table.measure(
        10,
        [](World &world) -> std::vector<double> {
            world.addGround();
            for (int i = 0; i < 125; i++) {
                const btVector3 at(1.3f * float(i % 5), 0.55f + 1.1f * float(i / 25),
                                   1.3f * float(i / 5 % 5));
                world.add(world.cube(), 1 + 0.01f * float(i), at);
            }
            world.step(60);
            const double fallbacks = world.board() ? double(world.board()->counts().fallbackSteps) : NONE;
            return {world.deepest(), fallbacks};
        },
        true);
    table.add(both, 0, "125 cubes of 125 masses: deepest after 1 s", "mm");
    table.add(both, 1, "steps with contacts, which Bullet took over", "", atMost(0));
}
