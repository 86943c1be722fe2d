// Properties of contacts that no board has, and the push out of deep penetration.
#include "table.h"

namespace {

// The largest difference of the heights from 1, 3, 5 ... m, or from `others`, mm.
double differenceOf(const std::vector<double> &heights, const std::vector<double> *others = nullptr) {
    double largest = 0;
    for (size_t i = 0; i < heights.size(); i++)
        largest = std::fmax(largest, std::fabs(heights[i] - (others ? (*others)[i] : 1 + 2 * double(i))));
    return 1e3 * largest;
}

// What becomes of ten boxes of 2 m that fall 19 m as a tower: their heights.
struct Fall {
    std::vector<double> heights;
    double asleep = 0, pushSteps = 0, cycles = 0, pushCycles = 0;
};

Fall runFall(World &world, int run) {
    Fall fall;
    Shifts shifts(run);
    world.bullet().setGravity(btVector3(0, -10, 0));
    world.add(world.shape<btBoxShape>(btVector3(50, 50, 50)), 0, btVector3(0, -50, 0));
    auto *box = world.shape<btBoxShape>(btVector3(1, 1, 1));
    std::vector<btRigidBody *> boxes;
    for (int i = 0; i < 10; i++)
        boxes.push_back(world.add(box, 1, btVector3(0, 20 + 2 * float(i), 0) + shifts.next()));
    for (int i = 0; i < 900; i++) {
        world.step();
        if (!world.board()) continue;
        const ZynqPgsCounts &counts = world.board()->counts();
        if (double(counts.pushSteps) == fall.pushSteps) continue;
        fall.pushSteps = double(counts.pushSteps);
        fall.cycles += double(counts.report.cycles);
        fall.pushCycles += double(counts.pushReport.cycles);
    }
    for (const btRigidBody *one : boxes) fall.heights.push_back(place(one).y());
    fall.asleep = world.asleep();
    return fall;
}

bool stands(const Fall &fall) { return fall.asleep == 10 && differenceOf(fall.heights) <= 20; }

// A cube that is 0.33 m deep in the ground: its highest speed upwards, and its place after a second.
std::vector<double> runDeep(World &world) {
    world.addGround();
    btRigidBody *cube = world.add(world.cube(), 1, btVector3(0, 0.17f, 0));
    double fastest = 0;
    for (int i = 0; i < 60; i++) {
        world.step();
        fastest = std::fmax(fastest, cube->getLinearVelocity().y());
    }
    return {fastest, place(cube).y()};
}

// A step of a cube that is deep in the ground with one edge, without forces: how far it rises, mm, and turns,
// degrees.
std::vector<double> runEdge(World &world) {
    world.bullet().setGravity(btVector3(0, 0, 0));
    world.addGround(0);
    const btQuaternion turn(btVector3(0, 0, 1), 20 * SIMD_RADS_PER_DEG);
    btRigidBody *cube = world.add(world.cube(), 1, btVector3(0, 0.45f, 0), 0, turn);
    world.step();
    const double angle = turn.angleShortestPath(cube->getWorldTransform().getRotation());
    return {1e3 * (place(cube).y() - 0.45), angle * SIMD_DEGS_PER_RAD};
}

// A ball with rolling friction and a box, side by side on a ramp.
std::vector<double> runRolling(World &world) {
    const btQuaternion turn(btVector3(0, 0, 1), 10 * SIMD_RADS_PER_DEG);
    world.add(world.shape<btBoxShape>(btVector3(50, 0.5f, 20)), 0, btVector3(0, 0, 0), 1, turn);
    const btVector3 start = quatRotate(turn, btVector3(20, 1, 0));
    btRigidBody *ball = world.add(world.shape<btSphereShape>(0.5f), 1, start, 1);
    // At the edge of the ramp's friction a ball of radius r stays where this is more than r tan 10 = 0.088 m.
    ball->setRollingFriction(0.1f);
    const btVector3 beside = quatRotate(turn, btVector3(20, 1, 5));
    btRigidBody *box = world.add(world.cube(), 1, beside, 1, turn);
    for (btRigidBody *body : {ball, box}) body->setActivationState(DISABLE_DEACTIVATION);
    world.step(300);
    const ZynqPgsCounts counts = world.board() ? world.board()->counts() : ZynqPgsCounts();
    return {(place(ball) - start).length(), ball->getLinearVelocity().length(),
            (place(box) - beside).length(), double(counts.propertyIslands), double(counts.boardSteps)};
}

// 125 bodies of eight shapes fall on a slope of 5 degrees, with rolling and spinning friction.
std::vector<double> runRollers(World &world) {
    world.bullet().setGravity(btVector3(0, -10, 0));
    const btQuaternion turn(btVector3(0, 0, 1), 5 * SIMD_RADS_PER_DEG);
    const auto ground = world.shape<btBoxShape>(btVector3(100, 50, 100));
    world.add(ground, 0, quatRotate(turn, btVector3(0, -50, 0)), 0.5f, turn);
    btCollisionShape *shapes[] = {world.shape<btSphereShape>(0.5f),
                                  world.shape<btCapsuleShape>(0.25f, 0.5f),
                                  world.shape<btCapsuleShapeX>(0.25f, 0.5f),
                                  world.shape<btCapsuleShapeZ>(0.25f, 0.5f),
                                  world.shape<btCylinderShape>(btVector3(0.3f, 0.5f, 0.3f)),
                                  world.shape<btCylinderShapeX>(btVector3(0.5f, 0.3f, 0.3f)),
                                  world.shape<btConeShape>(0.5f, 1.0f),
                                  world.shape<btBoxShape>(btVector3(0.5f, 0.5f, 0.5f))};
    for (int i = 0; i < 125; i++) {
        const btVector3 at(2.1f * float(i % 5), 3 + 2.1f * float(i / 25), 2.1f * float(i / 5 % 5));
        btRigidBody *body = world.add(shapes[i % 8], 1, at, 1);
        body->setRollingFriction(0.03f);
        body->setSpinningFriction(0.3f);
    }
    world.step(300);
    const ZynqPgsCounts counts = world.board() ? world.board()->counts() : ZynqPgsCounts();
    return {world.kineticEnergy(), double(counts.boardSteps)};
}

// The depth to which a box of 4 kg sinks, mm.
std::vector<double> runSoft(World &world) {
    // Bullet pushes no soft contact out of deep penetration.
    world.bullet().getSolverInfo().m_splitImpulse = false;
    world.addGround()->setContactStiffnessAndDamping(300, 10);
    btRigidBody *box = world.add(world.cube(), 4, btVector3(0, 0.5f, 0));
    world.step(600);
    const ZynqPgsCounts counts = world.board() ? world.board()->counts() : ZynqPgsCounts();
    return {1e3 * (0.5 - place(box).y()), double(counts.propertyIslands)};
}

// Ways to give a ball's contact with the ground a property that no board has. A callback sets a point's own.
struct Property {
    const char *name;
    void (*ofBody)(btRigidBody &);
    void (*ofPoint)(btManifoldPoint &);
};
const Property PROPERTIES[] = {
    {"rolling friction", [](btRigidBody &body) { body.setRollingFriction(0.1f); }, nullptr},
    {"spinning friction", [](btRigidBody &body) { body.setSpinningFriction(0.1f); }, nullptr},
    {"stiffness", [](btRigidBody &body) { body.setContactStiffnessAndDamping(1e4f, 10); }, nullptr},
    {"anisotropic friction", [](btRigidBody &body) { body.setAnisotropicFriction(btVector3(1, 1, 2)); },
     nullptr},
    {"friction anchors",
     [](btRigidBody &body) {
         body.setCollisionFlags(body.getCollisionFlags() | btCollisionObject::CF_HAS_FRICTION_ANCHOR);
     },
     nullptr},
    {"CFM", nullptr,
     [](btManifoldPoint &point) {
         point.m_contactPointFlags |= BT_CONTACT_FLAG_HAS_CONTACT_CFM;
         point.m_contactCFM = 0.1f;
     }},
    {"surface motion", nullptr,
     [](btManifoldPoint &point) {
         point.m_contactPointFlags |= BT_CONTACT_FLAG_LATERAL_FRICTION_INITIALIZED;
         point.m_lateralFrictionDir1 = btVector3(1, 0, 0);
         point.m_lateralFrictionDir2 = btVector3(0, 0, 1);
         point.m_contactMotion1 = 1;
     }},
    {"none", nullptr, nullptr},
};
const Property *inForce = nullptr;

bool setPoint(btManifoldPoint &point, const btCollisionObjectWrapper *, int, int,
              const btCollisionObjectWrapper *, int, int) {
    inForce->ofPoint(point);
    return true;
}

// Steps out of 30 that Bullet solved for the property, and that the board solved.
std::pair<double, double> runProperty(World &world, const Property &property) {
    world.bullet().getSolverInfo().m_solverMode |= SOLVER_ENABLE_FRICTION_DIRECTION_CACHING;
    world.addGround();
    btRigidBody *ball = world.add(world.shape<btSphereShape>(0.5f), 1, btVector3(0, 0.5f, 0));
    if (property.ofBody) property.ofBody(*ball);
    if (property.ofPoint) {
        ball->setCollisionFlags(ball->getCollisionFlags() | btCollisionObject::CF_CUSTOM_MATERIAL_CALLBACK);
        inForce = &property;
        gContactAddedCallback = setPoint;
    }
    world.step(30);
    gContactAddedCallback = nullptr;
    return {double(world.board()->counts().propertyIslands), double(world.board()->counts().boardSteps)};
}

// On the board, with other options.
std::vector<double> with(const Table &table, const ZynqPgsOptions &options,
                         std::vector<double> (*scene)(World &)) {
    World world(table.settings().board, options, table.iterations(10));
    return scene(world);
}

// On the board, which leaves the properties out.
std::vector<double> withoutProperties(const Table &table, std::vector<double> (*scene)(World &)) {
    ZynqPgsOptions options = table.settings().solver;
    options.ignoreProperties = true;
    return with(table, options, scene);
}

}  // namespace

void drop(Table &table) {
    Fall falls[2];
    const int passes[] = {10, 30};
    double standing[2][2] = {};
    for (int kind = 0; kind < 2; kind++)
        for (int run = 0; run < 40; run++) {
            int solver = 0;
            table.measure(passes[kind], [&](World &world) -> std::vector<double> {
                const Fall fall = runFall(world, run);
                if (run == 0 && kind == 0) falls[solver] = fall;
                standing[kind][solver++] += stands(fall);
                return {};
            });
        }
    const Fall &bullet = falls[0], &board = falls[1];
    table.add(bullet.asleep, board.asleep, "asleep at step 900, of 10", "", within(10, 10));
    table.add(differenceOf(bullet.heights), differenceOf(board.heights),
              "largest difference of a height from 1, 3 ... 19 m", "mm", atMost(20));
    table.add(NONE, differenceOf(board.heights, &bullet.heights), "largest difference from Bullet's heights",
              "mm", atMost(20));
    table.add(standing[0][0], standing[0][1], "of 40 nearly equal runs: asleep at these heights", "");
    table.add(standing[1][0], standing[1][1], "of 40 with 30 + 30 passes: asleep at these heights", "",
              atLeast(32));
    table.add(NONE, board.pushSteps, "steps with a second one, for deep points", "", within(1, 899));
    table.add(NONE, board.cycles / board.pushSteps, "of these steps: cycles of the first", "");
    table.add(NONE, board.pushCycles / board.pushSteps, "of these steps: cycles of the second", "");
}

void deep(Table &table) {
    const auto both = table.measure(10, runDeep);
    table.add(both, 0, "0.33 m deep: highest speed upwards", "m/s", atMost(1));
    table.add(both, 1, "place after 1 s, exact 0.5", "m", within(0.49, 0.51));
    auto edge = table.measure(10, runEdge);
    // By Bullet's own rule, so that the poses alone move.
    ZynqPgsOptions options = table.settings().solver;
    options.deepShare = 0;
    edge.board = with(table, options, runEdge);
    const std::string measures[] = {"one edge deep, --deep 0: rises in a step",
                                    "one edge deep, --deep 0: turns"};
    for (size_t i = 0; i < 2; i++)
        table.add(edge, i, measures[i], i ? "deg" : "mm",
                  within(0.99 * edge.bullet[i], 1.01 * edge.bullet[i]));
}

void rolling(Table &table) {
    const auto both = table.measure(10, runRolling);
    const double way = both.bullet[0];
    table.add(both, 0, "the ball's way in 5 s, rolling friction 0.1", "m", within(way - 0.001, way + 0.001));
    table.add(both, 1, "the ball's speed then", "m/s", atMost(0.01));
    table.add(both, 2, "the box's way, friction 1", "m", atMost(0.02));
    table.add(NONE, both.board[3], "steps in which Bullet solved the ball", "", within(299, 300));
    table.add(NONE, both.board[4], "steps in which the board solved the box", "", within(299, 300));
    table.add(NONE, withoutProperties(table, runRolling)[0], "the ball's way with --ignore-properties", "m",
              atLeast(5));
}

void rollers(Table &table) {
    const auto both = table.measure(10, runRollers);
    const double energy = both.bullet[0];
    table.add(both, 0, "kinetic energy at step 300", "J", within(0.99 * energy, 1.01 * energy));
    table.add(NONE, both.board[1], "steps of 300 that the board solved", "", within(0, 0));
    const std::vector<double> without = withoutProperties(table, runRollers);
    table.add(NONE, without[0], "kinetic energy with --ignore-properties", "J");
    table.add(NONE, without[1], "steps of 300 that the board then solved", "", atLeast(200));
}

void soft(Table &table) {
    const auto both = table.measure(10, runSoft);
    table.add(both, 0, "depth of the box after 10 s, exact 32.7", "mm",
              within(both.bullet[0] - 1, both.bullet[0] + 1));
    table.add(NONE, both.board[1], "steps in which Bullet solved the box", "", atLeast(1));
    table.add(NONE, withoutProperties(table, runSoft)[0], "depth with --ignore-properties", "mm", atMost(10));
}

void properties(Table &table) {
    for (const Property &property : PROPERTIES) {
        World world(table.settings().board, table.settings().solver, table.iterations(10));
        const auto steps = runProperty(world, property);
        const bool none = !property.ofBody && !property.ofPoint;
        table.add(steps.first, steps.second, std::string(property.name) + ": steps of 30 on either solver",
                  "", none ? within(30, 30) : within(0, 0));
    }
}
