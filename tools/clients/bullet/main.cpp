// bullet-client: Bullet's scenes on Bullet's own solver and on the board's, in one table.
#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "table.h"

namespace {

enum Exit { OK = 0, LIMIT = 1, USAGE = 2, SKIPPED = 77 };

const char USAGE_TEXT[] =
    "usage: bullet-client [SCENE...] [--board TEXT] [--iterations N] [--points N] [--reverse N] [--cold] "
    "[--by-place] [--deep N] [--ignore-properties] [--json] [--list] [--help]\n"
    "\n"
    "Runs scenes of Bullet on Bullet's own solver and on the board's, and prints both.\n"
    "Without a scene: all but `spread` and `time`.\n"
    "\n"
    "  --board TEXT      the board, as in docs/engines.md (emulated:float,world)\n"
    "  --iterations N    passes of contact and of friction, 1 to 255, in place of each scene's own\n"
    "  --points N        largest number of points of a collision, 1 to 4 (2)\n"
    "  --reverse N       reverse the order of the collisions every N steps, 0 to 1000 (3; 0 is never)\n"
    "  --cold            begin every step with impulses of 0 on the board; Bullet's own solver stays warm\n"
    "  --by-place        give the board the place of each point in the last step, not its impulse; the limits "
    "count\n"
    "  --deep N          speed of points deeper than the threshold, per cent of that at it, 0 to 100 (36)\n"
    "  --ignore-properties\n"
    "                    the board solves contacts without the properties that it lacks (rolling friction "
    "...)\n"
    "  --json            the table as JSON\n"
    "  --list            the scenes\n"
    "\n"
    "With one of the options from --iterations to --ignore-properties the limits are shown and do not "
    "count.\n"
    "\n"
    "exit status: 0; 1 a limit does not hold; 2 wrong usage; 77 the board does not open, nothing was run\n";

int usage(const std::string &found) {
    std::fprintf(stderr, "bullet-client: %s; --help says what is possible\n", found.c_str());
    return USAGE;
}

bool toNumber(const char *text, int low, int high, int &number) {
    char *end = nullptr;
    const long value = std::strtol(text, &end, 10);
    if (end == text || *end != '\0' || value < low || value > high) return false;
    number = int(value);
    return true;
}

const Scene *find(const std::string &name) {
    for (const Scene &scene : scenes())
        if (name == scene.name) return &scene;
    return nullptr;
}

}  // namespace

const std::vector<Scene> &scenes() {
    static const std::vector<Scene> all = {
        {"pile", "1,000 cubes of 1 kg fall", pile, false},
        {"wall", "80 bricks, and a ball of 20 kg against them", wall, false},
        {"tower", "cubes of 1 kg on each other, 10 + 10 passes", tower, false},
        {"ratio", "a cube of 100 kg on a cube of 1 kg, 10 + 10 passes", ratio, false},
        {"ramp", "boxes on a ramp of 20 degrees, each with its friction", ramp, false},
        {"groove", "a marble rolls in a V groove, friction 0.5", groove, false},
        {"spin", "10 rad/s about the vertical, and free flight (Gyroscopic)", spin, false},
        {"platform", "a kinematic platform (Kinematic Object)", platform, false},
        {"restitution", "a ball of restitution 0.8 falls 5 m", restitution, false},
        {"mesh", "60 boxes and 60 spheres on a mesh of triangles", mesh, false},
        {"ccd", "a fast ball against a thin wall", ccd, false},
        {"basic", "125 boxes of 0.2 m fall as a block (BasicExample)", basic, false},
        {"compound", "a body of three boxes (CompoundBoxes)", compound, false},
        {"pyramids", "pyramid, walls and tower of 1,076 boxes (Benchmark 2)", pyramids, false},
        {"ragdolls", "136 dolls of eleven bodies and ten joints (Benchmark 3)", ragdolls, false},
        {"heightfield", "200 bodies of five shapes on hills (Heightfield)", heightfield, false},
        {"drop", "ten boxes of 2 m and 1 kg fall 19 m, as a tower (MultipleBoxes)", drop, false},
        {"deep", "a cube deep in the ground", deep, false},
        {"rolling", "a ball with rolling friction and a box on a ramp of 10 degrees (InclinedPlane)", rolling,
         false},
        {"rollers", "125 bodies with rolling and spinning friction (RollingFrictionDemo)", rollers, false},
        {"soft", "a box of 4 kg on contacts of stiffness 300 and damping 10 (RigidBodySoftContact)", soft,
         false},
        {"properties", "a ball on the ground, its contact with a property that no board has", properties,
         false},
        {"masses", "more masses than the table of the board", masses, false},
        {"worlds", "a heap of cubes and one of balls, two worlds on one board", worlds, false},
        {"warm", "1,000 jumbled cubes, a step with the last one's impulses and one without", warmth, false},
        {"spread", "pile and tower, the bodies shifted by at most 1 mm", spread, true},
        {"time", "a step of jumbled cubes, both solvers on the same contacts, 10 + 10 passes", timing, true},
    };
    return all;
}

int main(int count, char **arguments) {
    Settings settings;
    std::vector<const Scene *> chosen;
    bool json = false;
    for (int i = 1; i < count; i++) {
        const std::string argument = arguments[i];
        const char *value = i + 1 < count ? arguments[i + 1] : nullptr;
        if (argument == "--help") {
            std::fputs(USAGE_TEXT, stdout);
            return OK;
        } else if (argument == "--list") {
            for (const Scene &scene : scenes()) std::printf("%-12s %s\n", scene.name, scene.title);
            return OK;
        } else if (argument == "--json") {
            json = true;
        } else if (argument == "--cold") {
            settings.solver.warmStart = false;
        } else if (argument == "--by-place") {
            settings.solver.byPlace = true;
        } else if (argument == "--ignore-properties") {
            settings.solver.ignoreProperties = true;
        } else if (argument == "--board" || argument == "--iterations" || argument == "--points" ||
                   argument == "--reverse" || argument == "--deep") {
            if (!value) return usage(argument + " needs a value");
            i++;
            if (argument == "--board") {
                settings.board = value;
            } else if (argument == "--iterations") {
                if (!toNumber(value, 1, 255, settings.iterations))
                    return usage("expected 1 to 255 after --iterations, found " + std::string(value));
            } else if (argument == "--deep") {
                int share = 0;
                if (!toNumber(value, 0, 100, share))
                    return usage("expected 0 to 100 after --deep, found " + std::string(value));
                settings.solver.deepShare = 0.01f * float(share);
            } else if (argument == "--reverse") {
                if (!toNumber(value, 0, 1000, settings.solver.reverseEvery))
                    return usage("expected 0 to 1000 after --reverse, found " + std::string(value));
            } else if (!toNumber(value, 1, ZPGS_CONTACT_POINTS, settings.solver.pointsPerCollision)) {
                return usage("expected 1 to 4 after --points, found " + std::string(value));
            }
        } else if (const Scene *scene = find(argument)) {
            chosen.push_back(scene);
        } else {
            return usage("no scene or option " + argument);
        }
    }
    if (chosen.empty())
        for (const Scene &scene : scenes())
            if (!scene.onDemand) chosen.push_back(&scene);

    zpgs_accelerator *board = nullptr;
    if (zpgs_open(settings.board.c_str(), &board) != ZPGS_STATUS_OK) {
        std::fprintf(stderr, "bullet-client: skipped, no board: %s\n", zpgs_last_error(nullptr));
        return SKIPPED;
    }
    zpgs_close(board);

    Table table(settings);
    for (const Scene *scene : chosen) {
        table.begin(scene->name);
        scene->run(table);
    }
    if (json)
        table.printJson();
    else
        table.print();
    return table.failed() ? LIMIT : OK;
}
