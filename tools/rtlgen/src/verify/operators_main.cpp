// Clocks operators_top: reads the operands of BATCH cycles, then writes their results, until the
// end of stdin.
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <vector>

#include "Voperators_top.h"

int main() {
    std::vector<uint32_t> operands(BATCH * OPERANDS);
    std::vector<uint32_t> results(BATCH * RESULTS);
    Voperators_top top;
    while (std::fread(operands.data(), sizeof(uint32_t) * OPERANDS, BATCH, stdin) == BATCH) {
        for (size_t cycle = 0; cycle < BATCH; cycle++) {
            std::memcpy(&top.operands[0], &operands[cycle * OPERANDS], sizeof(uint32_t) * OPERANDS);
            top.clk = 0;
            top.eval();
            top.clk = 1;
            top.eval();
            std::memcpy(&results[cycle * RESULTS], &top.results[0], sizeof(uint32_t) * RESULTS);
        }
        if (std::fwrite(results.data(), sizeof(uint32_t) * RESULTS, BATCH, stdout) != BATCH) return 1;
        std::fflush(stdout);
    }
    return 0;
}
