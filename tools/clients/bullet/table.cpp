#include "table.h"

#include <cstdio>

namespace {

std::string number(double value, int digits = 3) {
    if (std::isnan(value)) return "-";
    char text[32];
    const double size = std::fabs(value);
    if (size >= 1000)
        std::snprintf(text, sizeof text, "%.0f", value);
    else if (size != 0 && size < 0.001)
        std::snprintf(text, sizeof text, "%.1e", value);
    else
        std::snprintf(text, sizeof text, "%.*g", digits, value);
    return text;
}

std::string words(const Limit &limit) {
    if (!limit.isSet()) return "";
    if (!std::isfinite(limit.low)) return "at most " + number(limit.high, 4);
    if (!std::isfinite(limit.high)) return "at least " + number(limit.low, 4);
    if (limit.low == limit.high) return number(limit.low, 4);
    return number(limit.low, 4) + " to " + number(limit.high, 4);
}

std::string quoted(const std::string &text) {
    std::string out = "\"";
    for (const char letter : text) {
        if (letter == '"' || letter == '\\') out += '\\';
        out += letter;
    }
    return out + "\"";
}

std::string json(double value) {
    if (!std::isfinite(value)) return "null";
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", value);
    return text;
}

}  // namespace

Table::Both Table::measure(int ownIterations, const std::function<std::vector<double>(World &)> &scene,
                           bool expectFallback) {
    Both both;
    {
        World world("", m_settings.solver, iterations(ownIterations));
        both.bullet = scene(world);
    }
    World world(m_settings.board, m_settings.solver, iterations(ownIterations));
    both.board = scene(world);
    const ZynqPgsSolver &board = *world.board();
    if (board.counts().fallbackSteps > 0 && !expectFallback) {
        const double steps = double(board.counts().fallbackSteps);
        std::fprintf(stderr, "bullet-client: %s: %s\n", m_scene.c_str(), board.lastError().c_str());
        add(NONE, steps, "steps that the board did not take", "", within(0, 0));
    }
    return both;
}

void Table::add(const Both &both, size_t index, const std::string &measure, const std::string &unit,
                Limit limit) {
    add(both.bullet[index], both.board[index], measure, unit, limit);
}

void Table::add(double bullet, double board, const std::string &measure, const std::string &unit,
                Limit limit) {
    m_rows.push_back({m_scene, measure, unit, bullet, board, limit});
}

std::string Table::verdict(const Row &row) const {
    if (!row.limit.isSet()) return "";
    if (row.limit.holds(row.board)) return "ok";
    if (row.limit.chaotic) return "no; chaotic";
    return m_settings.areOwn() ? "FAILS" : "no; other settings";
}

bool Table::failed() const {
    for (const Row &row : m_rows)
        if (verdict(row) == "FAILS") return true;
    return false;
}

void Table::print() const {
    std::printf("Bullet %d.%02d; board %s, zynq-pgs %s\n", BT_BULLET_VERSION / 100, BT_BULLET_VERSION % 100,
                m_settings.board.c_str(), zpgs_version());
    std::printf("%-52s %10s %10s %-6s %s\n", "", "Bullet", "board", "", "limit of the board");
    std::string scene;
    for (const Row &row : m_rows) {
        if (row.scene != scene) {
            scene = row.scene;
            for (const Scene &known : scenes())
                if (scene == known.name) std::printf("%s: %s\n", known.name, known.title);
        }
        std::string end = verdict(row);
        if (!end.empty()) end = words(row.limit) + ": " + end;
        const std::string unit = row.unit + (end.empty() ? "" : std::string(7 - row.unit.size(), ' '));
        std::printf("  %-50s %10s %10s%s%s%s\n", row.measure.c_str(), number(row.bullet).c_str(),
                    number(row.board).c_str(), unit.empty() ? "" : " ", unit.c_str(), end.c_str());
    }
}

void Table::printJson() const {
    std::printf("{\"board\": %s, \"rows\": [", quoted(m_settings.board).c_str());
    const char *comma = "";
    for (const Row &row : m_rows) {
        std::printf("%s\n  {\"scene\": %s, \"measure\": %s, \"unit\": %s, \"bullet\": %s, \"board\": %s,",
                    comma, quoted(row.scene).c_str(), quoted(row.measure).c_str(), quoted(row.unit).c_str(),
                    json(row.bullet).c_str(), json(row.board).c_str());
        std::printf(" \"low\": %s, \"high\": %s, \"verdict\": %s}", json(row.limit.low).c_str(),
                    json(row.limit.high).c_str(), quoted(verdict(row)).c_str());
        comma = ",";
    }
    std::printf("\n]}\n");
}
