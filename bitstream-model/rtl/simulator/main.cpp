// The Verilated accelerator as a process: requests on standard input, answers on standard output.
// bitstream-model/src/external/process.rs has the protocol and is the other end.
//
// usage: SIMULATOR [GAPS STALLS SEED [WAVEFORM]]
//
// GAPS and STALLS: TVALID gaps in front of the accelerator and TREADY stalls behind it, in a thousand
// cycles, at random. WAVEFORM: the VCD file that a `record` request begins.
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "Vpgs_top.h"
#include "Vpgs_top___024root.h"
#include "verilated.h"
#if VM_TRACE
#include "verilated_vcd_c.h"
#endif

static const int STREAMS = 4;
static const int READ_CLOCKS = 16;  // a read is answered long before
static const size_t BEAT_WORDS = 5;  // four words and the marks

static Vpgs_top *top;
static uint64_t random_state;

static uint32_t per_mille() {
  random_state ^= random_state << 13;
  random_state ^= random_state >> 7;
  random_state ^= random_state << 17;
  return random_state % 1000;
}

// The process ends with its standard input.
static void receive(void *to, size_t bytes) {
  for (char *at = static_cast<char *>(to); bytes > 0;) {
    const ssize_t got = read(0, at, bytes);
    if (got <= 0) _exit(0);
    at += got;
    bytes -= got;
  }
}

static void answer(const void *from, size_t bytes) {
  for (const char *at = static_cast<const char *>(from); bytes > 0;) {
    const ssize_t put = write(1, at, bytes);
    if (put <= 0) _exit(1);
    at += put;
    bytes -= put;
  }
}

#if VM_TRACE
// Modules below the top one whose signals a waveform shows.
static const int WAVEFORM_LEVELS = 3;
static const char *waveform_path;
static VerilatedVcdC *waveform;
static uint64_t edges;

static bool record(bool on) {
  if (on && waveform == nullptr && waveform_path != nullptr) {
    waveform = new VerilatedVcdC;
    top->trace(waveform, WAVEFORM_LEVELS);
    waveform->open(waveform_path);
  } else if (!on && waveform != nullptr) {
    waveform->close();
    delete waveform;
    waveform = nullptr;
  }
  return on ? waveform != nullptr && waveform->isOpen() : true;
}

static void dump() {
  if (waveform != nullptr) waveform->dump(edges);
  edges++;
}
#else
static bool record(bool) { return false; }
static void dump() {}
#endif

static void rising_edge() {
  top->aclk = 1;
  top->eval();
  dump();
  top->aclk = 0;
  top->eval();
  dump();
}

struct Stream {
  CData *tvalid, *tready, *tlast;
  SData *tkeep;
  WData *tdata;
};

static Stream inputs[STREAMS], outputs[STREAMS];

static void connect() {
#define IN(k) inputs[k] = {&top->s##k##_axis_tvalid, &top->s##k##_axis_tready, &top->s##k##_axis_tlast, &top->s##k##_axis_tkeep, &top->s##k##_axis_tdata[0]};
#define OUT(k) outputs[k] = {&top->m##k##_axis_tvalid, &top->m##k##_axis_tready, &top->m##k##_axis_tlast, nullptr, &top->m##k##_axis_tdata[0]};
  IN(0) IN(1) IN(2) IN(3)
  OUT(0) OUT(1) OUT(2) OUT(3)
}

static void idle_streams() {
  for (int k = 0; k < STREAMS; k++) *inputs[k].tvalid = *outputs[k].tready = 0;
}

static uint32_t read_register(uint32_t offset) {
  idle_streams();
  top->s_axi_araddr = offset;
  top->s_axi_arvalid = 1;
  top->eval();
  rising_edge();
  top->s_axi_arvalid = 0;
  for (int clocks = 0; clocks < READ_CLOCKS && !top->s_axi_rvalid; clocks++) rising_edge();
  // Without an answer there is no accelerator.
  if (!top->s_axi_rvalid) _exit(3);
  const uint32_t value = top->s_axi_rdata;
  rising_edge();
  return value;
}

static void write_register(uint32_t offset, uint32_t value) {
  idle_streams();
  top->s_axi_awaddr = offset;
  top->s_axi_wdata = value;
  top->s_axi_awvalid = top->s_axi_wvalid = 1;
  top->eval();
  rising_edge();
  top->s_axi_awvalid = top->s_axi_wvalid = 0;
  rising_edge();
}

static bool busy() {
  const auto *root = top->rootp;
  return root->pgs_top__DOT__busy || root->pgs_top__DOT__starting;
}

static void run(uint32_t limit, uint32_t gaps, uint32_t stalls) {
  static std::vector<uint32_t> offered[STREAMS], sent[STREAMS];
  static bool held[STREAMS];  // a beat once offered stays offered
  uint32_t count[STREAMS], space[STREAMS], taken[STREAMS] = {0, 0, 0, 0}, clocks = 0;
  receive(count, sizeof count);
  receive(space, sizeof space);
  for (int k = 0; k < STREAMS; k++) {
    offered[k].resize(BEAT_WORDS * count[k]);
    receive(offered[k].data(), 4 * offered[k].size());
    sent[k].clear();
  }
  while (clocks < limit) {
    for (int k = 0; k < STREAMS; k++) {
      held[k] = taken[k] < count[k] && (held[k] || gaps == 0 || per_mille() >= gaps);
      *inputs[k].tvalid = held[k];
      if (held[k]) {
        const uint32_t *beat = &offered[k][BEAT_WORDS * taken[k]];
        memcpy(inputs[k].tdata, beat, 16);
        *inputs[k].tlast = beat[4] & 1;
        *inputs[k].tkeep = beat[4] & 2 ? 0x0fff : 0xffff;
      }
      *outputs[k].tready = sent[k].size() < BEAT_WORDS * space[k] && (stalls == 0 || per_mille() >= stalls);
    }
    top->eval();
    for (int k = 0; k < STREAMS; k++) {
      if (*outputs[k].tvalid && *outputs[k].tready) {
        sent[k].insert(sent[k].end(), outputs[k].tdata, outputs[k].tdata + 4);
        sent[k].push_back(*outputs[k].tlast | clocks << 8);
      }
      if (*inputs[k].tvalid && *inputs[k].tready) {
        taken[k]++;
        held[k] = false;
      }
    }
    rising_edge();
    clocks++;
    if (top->irq) break;
  }
  const uint32_t head[2] = {clocks, static_cast<uint32_t>(top->irq) | (busy() ? 2u : 0u)};
  uint32_t sizes[STREAMS];
  answer(head, sizeof head);
  answer(taken, sizeof taken);
  for (int k = 0; k < STREAMS; k++) sizes[k] = sent[k].size() / BEAT_WORDS;
  answer(sizes, sizeof sizes);
  for (int k = 0; k < STREAMS; k++) answer(sent[k].data(), 4 * sent[k].size());
}

int main(int argc, char **argv) {
  const uint32_t gaps = argc > 1 ? atoi(argv[1]) : 0;
  const uint32_t stalls = argc > 2 ? atoi(argv[2]) : 0;
  random_state = (argc > 3 ? strtoull(argv[3], nullptr, 10) : 1) * 0x9E3779B97F4A7C15ull | 1;
#if VM_TRACE
  Verilated::traceEverOn(true);
  waveform_path = argc > 4 ? argv[4] : nullptr;
#endif
  top = new Vpgs_top;
  connect();
  idle_streams();
  top->s_axi_bready = top->s_axi_rready = 1;
  top->s_axi_wstrb = 15;
  top->aresetn = 0;
  for (int i = 0; i < 8; i++) rising_edge();
  top->aresetn = 1;
  for (int i = 0; i < 80; i++) rising_edge();
  for (;;) {
    uint32_t request[3];
    receive(request, sizeof request);
    uint32_t value = 0;
    switch (request[0]) {
      case 1:
        value = read_register(request[1]);
        answer(&value, 4);
        break;
      case 2:
        write_register(request[1], request[2]);
        answer(&value, 4);
        break;
      case 3:
        run(request[1], gaps, stalls);
        break;
      case 4:
        value = record(request[1] != 0);
        answer(&value, 4);
        break;
      default:
        return 2;
    }
  }
}
