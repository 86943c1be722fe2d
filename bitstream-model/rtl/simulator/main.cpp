// The Verilated accelerator as a process: requests on standard input, answers on standard output.
// bitstream-model/src/external/process.rs has the protocol and is the other end.
//
// usage: SIMULATOR [GAPS STALLS SEED [WAVEFORM]]
//
// GAPS and STALLS: TVALID gaps in front of the accelerator and TREADY stalls behind it, in a thousand
// cycles, at random. WAVEFORM: the VCD file that a `record` request begins.
//
// STREAMS, the number of streams each way, comes from the generator. A stream of 64 bits carries a beat in two
// transfers, low bits first.
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

static const int MESSAGE_STREAMS = 4;  // in requests and answers
static const int WORDS = 4;            // of a beat
static const uint32_t RESET_OFFSET = 0x1c0;
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
  WData *tdata;
  int words;         // of a transfer
  int at;            // words of the beat that have been transferred
  uint32_t beat[WORDS];
};

static Stream stream(CData &tvalid, CData &tready, CData &tlast, VlWide<WORDS> &tdata) {
  return {&tvalid, &tready, &tlast, &tdata[0], WORDS, 0, {}};
}

static Stream stream(CData &tvalid, CData &tready, CData &tlast, QData &tdata) {
  return {&tvalid, &tready, &tlast, reinterpret_cast<WData *>(&tdata), WORDS / 2, 0, {}};
}

static Stream inputs[STREAMS], outputs[STREAMS];

static void connect() {
#define PORTS(side, k) stream(top->side##k##_axis_tvalid, top->side##k##_axis_tready, top->side##k##_axis_tlast, top->side##k##_axis_tdata)
#define STREAM(k) inputs[k] = PORTS(s, k), outputs[k] = PORTS(m, k);
  STREAM(0) STREAM(1) STREAM(2)
#if STREAMS > 3
  STREAM(3)
#endif
}

static void set_tkeep(int k, bool whole) {
  const int bytes = 4 * inputs[k].words;
  const int keep = whole ? (1 << bytes) - 1 : (1 << (bytes - 4)) - 1;
  switch (k) {
    case 0: top->s0_axis_tkeep = keep; break;
    case 1: top->s1_axis_tkeep = keep; break;
    case 2: top->s2_axis_tkeep = keep; break;
#if STREAMS > 3
    case 3: top->s3_axis_tkeep = keep; break;
#endif
  }
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
  // A reset drops the rest of a beat.
  if (offset == RESET_OFFSET)
    for (int k = 0; k < STREAMS; k++) inputs[k].at = outputs[k].at = 0;
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
  static bool held[STREAMS];  // a transfer once offered stays offered
  uint32_t count[MESSAGE_STREAMS], space[MESSAGE_STREAMS], taken[MESSAGE_STREAMS] = {0, 0, 0, 0}, clocks = 0;
  receive(count, sizeof count);
  receive(space, sizeof space);
  // The streams that the accelerator does not have carry nothing.
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
        const bool ends = inputs[k].at + inputs[k].words == WORDS;
        memcpy(inputs[k].tdata, beat + inputs[k].at, 4 * inputs[k].words);
        *inputs[k].tlast = ends && beat[WORDS] & 1;
        set_tkeep(k, !(ends && beat[WORDS] & 2));
      }
      const bool room = outputs[k].at > 0 || sent[k].size() < BEAT_WORDS * space[k];
      *outputs[k].tready = room && (stalls == 0 || per_mille() >= stalls);
    }
    top->eval();
    for (int k = 0; k < STREAMS; k++) {
      if (*outputs[k].tvalid && *outputs[k].tready) {
        Stream &out = outputs[k];
        memcpy(out.beat + out.at, out.tdata, 4 * out.words);
        out.at = (out.at + out.words) % WORDS;
        if (out.at == 0) {
          sent[k].insert(sent[k].end(), out.beat, out.beat + WORDS);
          sent[k].push_back(*out.tlast | clocks << 8);
        }
      }
      if (*inputs[k].tvalid && *inputs[k].tready) {
        inputs[k].at = (inputs[k].at + inputs[k].words) % WORDS;
        taken[k] += inputs[k].at == 0;
        held[k] = false;
      }
    }
    rising_edge();
    clocks++;
    if (top->irq) break;
  }
  const uint32_t head[2] = {clocks, static_cast<uint32_t>(top->irq) | (busy() ? 2u : 0u)};
  uint32_t sizes[MESSAGE_STREAMS] = {0, 0, 0, 0};
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
