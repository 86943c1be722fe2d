// Steps that Bullet's own solver takes, and masses beyond the table of the board.
#include "table.h"

void joints(Table &table) {
    const auto both = table.measure(10, [](World &world) -> std::vector<double> {
        world.addGround();
        auto *link = world.shape<btBoxShape>(btVector3(0.25f, 0.25f, 0.25f));
        btRigidBody *last = nullptr;
        for (int i = 0; i < 8; i++) {
            btRigidBody *next = world.add(link, 1, btVector3(0.6f * float(i), 4, 0));
            if (last) world.join(last, next, btVector3(0.3f, 0, 0), btVector3(-0.3f, 0, 0));
            last = next;
        }
        for (int i = 0; i < 8; i++) world.add(world.cube(), 1, btVector3(2 * float(i), 0.5f, 20));
        double jointSteps = 0, boardSteps = 0;
        world.step(120);
        if (world.board()) {
            jointSteps = double(world.board()->counts().jointGroups);
            boardSteps = double(world.board()->counts().boardSteps);
        }
        return {place(last).y(), jointSteps, boardSteps};
    });
    table.add(both, 0, "height of the chain's last link after 2 s", "m",
              within(both.bullet[0] - 0.01, both.bullet[0] + 0.01));
    table.add(NONE, both.board[1], "steps in which Bullet solved the chain", "", within(120, 120));
    table.add(NONE, both.board[2], "steps in which the board solved the boxes", "", within(120, 120));
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
