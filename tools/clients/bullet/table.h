// What the scenes measure, on both solvers, and the limits that they state.
#pragma once

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "world.h"

const double NONE = std::numeric_limits<double>::quiet_NaN();

// Where a measure of the board must lie.
struct Limit {
    double low = -std::numeric_limits<double>::infinity();
    double high = std::numeric_limits<double>::infinity();
    // Chance decides whether it holds: it is shown and does not fail.
    bool chaotic = false;

    bool isSet() const { return std::isfinite(low) || std::isfinite(high); }
    bool holds(double value) const { return value >= low && value <= high; }
};
inline Limit atMost(double high) { return {-std::numeric_limits<double>::infinity(), high, false}; }
inline Limit atLeast(double low) { return {low, std::numeric_limits<double>::infinity(), false}; }
inline Limit within(double low, double high) { return {low, high, false}; }
inline Limit chaotic(Limit limit) {
    limit.chaotic = true;
    return limit;
}

struct Row {
    std::string scene, measure, unit;
    double bullet = NONE, board = NONE;
    Limit limit;
};

class Table {
public:
    explicit Table(const Settings &settings) : m_settings(settings) {}
    const Settings &settings() const { return m_settings; }

    // Starts the rows of a scene.
    void begin(const std::string &scene) { m_scene = scene; }
    // Passes of a scene that wants `own`.
    int iterations(int own) const { return m_settings.iterations > 0 ? m_settings.iterations : own; }

    // The measures of a scene on Bullet's solver and on the board's.
    struct Both {
        std::vector<double> bullet, board;
    };
    // Steps that Bullet's solver took from the board fail the scene, unless it expects them.
    Both measure(int ownIterations, const std::function<std::vector<double>(World &)> &scene,
                 bool expectFallback = false);

    // One row: measure `index` of `both`. A limit counts with the settings that the scene has without
    // options.
    void add(const Both &both, size_t index, const std::string &measure, const std::string &unit,
             Limit limit = Limit());
    void add(double bullet, double board, const std::string &measure, const std::string &unit,
             Limit limit = Limit());

    // True if a limit does not hold.
    bool failed() const;
    void print() const;
    void printJson() const;

private:
    std::string verdict(const Row &row) const;

    const Settings m_settings;
    std::string m_scene;
    std::vector<Row> m_rows;
};

struct Scene {
    const char *name;
    const char *title;
    void (*run)(Table &);
    // Only where it is named.
    bool onDemand;
};
const std::vector<Scene> &scenes();

// In scenes_*.cpp.
void pile(Table &), wall(Table &), tower(Table &), ratio(Table &), spread(Table &);
void ramp(Table &), groove(Table &), spin(Table &);
void platform(Table &), restitution(Table &), mesh(Table &), ccd(Table &);
void basic(Table &), compound(Table &), pyramids(Table &), heightfield(Table &);
void ragdolls(Table &), masses(Table &), worlds(Table &);
void drop(Table &), deep(Table &), rolling(Table &), rollers(Table &), soft(Table &), properties(Table &);
void warmth(Table &), timing(Table &);
