// A model of a Cortex-A53 for QEMU in user mode: instructions and clocks of chosen functions, on paper.
//
// The core issues in order, two instructions a clock at most: one load or store, one multiplication, one addition of
// the floating-point unit, one branch. Results come after the latencies of `decode`. A miss of the first level of
// 32 KB costs L2 clocks beyond a hit, a miss of the second of 1 MB costs MEMORY clocks, or STREAM if the addresses run
// on from line to line. Misses of loads overlap until a result is used. PRFM is an instruction without effect, so that
// software prefetches gain nothing here. Sources: Arm, Cortex-A53 technical reference manual; Arm ARM, section C4.1
// (encodings); memory as in docs/a53-cost.md.
//
//   qemu-aarch64 -d plugin -D /dev/null -cpu cortex-a53 -plugin ./a53.so,group=NAME:PART,group=NAME:PART:NOT... PROGRAM
//
// A group counts each function whose symbol holds PART and no NOT; the first group that fits takes it. QEMU 7.2 ships
// no header of its plugin interface (version 1): its prototypes stand here.
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef uint64_t plugin_id;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
#define EXPORT __attribute__((visibility("default")))
EXPORT int qemu_plugin_version = 1;
void qemu_plugin_register_vcpu_tb_trans_cb(plugin_id, void (*)(plugin_id, struct qemu_plugin_tb *));
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *);
struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *, size_t);
const void *qemu_plugin_insn_data(const struct qemu_plugin_insn *);
const char *qemu_plugin_insn_symbol(const struct qemu_plugin_insn *);
void qemu_plugin_register_vcpu_insn_exec_cb(struct qemu_plugin_insn *, void (*)(unsigned, void *), int, void *);
void qemu_plugin_register_vcpu_mem_cb(struct qemu_plugin_insn *, void (*)(unsigned, uint32_t, uint64_t, void *), int,
                                      int, void *);
void qemu_plugin_register_atexit_cb(plugin_id, void (*)(plugin_id, void *), void *);
bool qemu_plugin_mem_is_store(uint32_t);

enum { L2 = 15, MEMORY = 130, STREAM = 16, FLOAT = 4 };

// ---- Groups of functions
#define GROUPS 32
typedef struct {
  const char *name, *part, *unlike;
  uint64_t instructions, first_misses, second_misses;
  double clocks;
} Group;
static Group groups[GROUPS];
static int group_count;

// ---- Caches: lines of 64 bytes, least recently used
typedef struct {
  unsigned sets, ways;
  uint64_t *line, *used, now;
} Cache;
static Cache first, second;

static void make(Cache *cache, unsigned bytes, unsigned ways) {
  *cache = (Cache){.sets = bytes / 64 / ways, .ways = ways};
  cache->line = calloc(cache->sets * ways, sizeof *cache->line);
  cache->used = calloc(cache->sets * ways, sizeof *cache->used);
}

// Whether the line is there; afterwards it is.
static bool holds(Cache *cache, uint64_t line) {
  unsigned from = (line & (cache->sets - 1)) * cache->ways, oldest = from;
  cache->now++;
  for (unsigned at = from; at < from + cache->ways; at++) {
    if (cache->line[at] == line) {
      cache->used[at] = cache->now;
      return true;
    }
    if (cache->used[at] < cache->used[oldest]) oldest = at;
  }
  cache->line[oldest] = line;
  cache->used[oldest] = cache->now;
  return false;
}

#define STREAMS 16
static struct { uint64_t line; unsigned hits; } streams[STREAMS];
static unsigned next_stream;

// Whether a miss continues a row of lines that the prefetcher has seen twice.
static bool foreseen(uint64_t line) {
  for (unsigned at = 0; at < STREAMS; at++) {
    uint64_t ahead = line - streams[at].line;
    if (ahead >= 1 && ahead <= 4) {
      streams[at].line = line;
      return ++streams[at].hits >= 2;
    }
  }
  streams[next_stream].line = line;
  streams[next_stream].hits = 0;
  next_stream = (next_stream + 1) % STREAMS;
  return false;
}

static double miss(uint64_t address, Group *group, bool store) {
  uint64_t line = address >> 6;
  if (holds(&first, line)) return 0;
  group->first_misses++;
  bool stream = foreseen(line);
  if (holds(&second, line)) return stream || store ? 2 : L2;
  group->second_misses++;
  return stream || store ? STREAM : MEMORY;
}

// ---- Instructions
enum { ALU, LOAD, STORE, BRANCH, ADD, MULTIPLY, FUSED, DIVIDE, UNITS };
enum { NONE = 64, FLAGS = 65, REGISTERS = 66 }; // x0 to x30 and sp, v0 to v31 from 32 on
typedef struct {
  Group *group;
  uint8_t unit, latency, busy, to[2], from[4];
} Instruction;

static uint8_t integer(uint32_t number) { return number == 31 ? NONE : number; }

static void decode_memory(Instruction *in, uint32_t word) {
  bool vector = word >> 26 & 1, pair = (word >> 27 & 7) == 5 && (word >> 25 & 1) == 0;
  bool quad = vector && (pair ? word >> 30 == 2 : (word >> 23 & 1) && word >> 30 == 0);
  bool literal = (word >> 27 & 7) == 3 && (word >> 24 & 3) == 0;
  bool load = literal || (pair || (word >> 24 & 0x3F) == 0x0C || (word >> 24 & 0x3F) == 0x0D || (word >> 24 & 0x3F) == 8
                              ? word >> 22 & 1
                              : (word >> 22 & 3) != 0 && !(vector && (word >> 22 & 3) == 2));
  uint8_t data = vector ? 32 + (word & 31) : integer(word & 31);
  uint8_t other = pair ? (vector ? 32 + (word >> 10 & 31) : integer(word >> 10 & 31)) : NONE;
  in->unit = load ? LOAD : STORE;
  in->latency = vector ? 4 : 3;
  in->busy = pair && quad ? (load ? 4 : 2) : quad && load ? 2 : 1;
  in->from[0] = literal ? NONE : word >> 5 & 31; // 31 is sp
  bool indexed = (word >> 27 & 7) == 7 && (word >> 24 & 1) == 0 && (word >> 21 & 1) == 1 && (word >> 10 & 3) == 2;
  in->from[1] = indexed ? integer(word >> 16 & 31) : NONE;
  // A store needs its data late: it never waits for them.
  if (load) in->to[0] = data, in->to[1] = other;
}

static void decode_vector(Instruction *in, uint32_t word) {
  bool scalar = (word >> 28 & 7) == 1 && (word >> 24 & 0xF) >= 0xE; // FP of one number
  uint8_t d = 32 + (word & 31), n = 32 + (word >> 5 & 31), m = 32 + (word >> 16 & 31);
  bool wide = word >> 30 & 1;
  *in = (Instruction){.group = in->group, .unit = ADD, .latency = 3, .busy = 1, .to = {d, NONE}, .from = {n, m, NONE, NONE}};
  if (scalar && (word >> 24 & 1)) { // FMADD and its like
    in->unit = FUSED, in->latency = 2 * FLOAT, in->from[2] = 32 + (word >> 10 & 31);
  } else if (scalar) {
    bool two = (word >> 10 & 3) == 2, compares = (word >> 10 & 0xF) == 8, moves_integer = (word >> 10 & 0x3F) == 0;
    unsigned operation = word >> 12 & 0xF;
    in->latency = FLOAT;
    if (two && (operation == 0 || operation == 8)) in->unit = MULTIPLY;
    if (two && operation == 1) in->unit = DIVIDE, in->latency = 13, in->busy = 10;
    if ((word >> 10 & 0x1F) == 0x10) { // one source: FMOV, FABS, FNEG, FSQRT, FCVT
      in->from[1] = NONE, in->latency = 2;
      if ((word >> 15 & 0x3F) == 3) in->unit = DIVIDE, in->latency = 12, in->busy = 9;
    }
    if (compares || (word >> 10 & 3) == 1) in->to[0] = FLAGS; // FCMP, FCCMP
    if ((word >> 10 & 3) == 3) in->from[2] = FLAGS;           // FCSEL
    if (moves_integer) {
      bool out = (word >> 16 & 7) == 6 || (word >> 19 & 3) == 3 || (word >> 17 & 3) == 0;
      in->from[1] = NONE;
      if (out) in->to[0] = integer(word & 31);
      else in->from[0] = integer(word >> 5 & 31);
    }
  } else if ((word >> 24 & 0x1F) == 0x0E && (word >> 21 & 1) && (word >> 10 & 1)) { // three of the same kind
    unsigned operation = word >> 11 & 0x1F;
    bool upper = word >> 29 & 1;
    if (operation >= 0x18) in->latency = FLOAT;
    if (operation == 0x1B && upper) in->unit = MULTIPLY;
    if (operation == 0x19 && !upper) in->unit = FUSED, in->latency = 2 * FLOAT, in->from[2] = d;
    if (operation == 0x1F && upper) in->unit = DIVIDE, in->latency = wide ? 40 : 13, in->busy = wide ? 37 : 10;
    if (operation == 3 && upper && (word >> 22 & 3)) in->from[2] = d; // BSL, BIT, BIF
  } else if ((word >> 24 & 0x1F) == 0x0E && (word >> 17 & 0x1F) == 0x10 && (word >> 10 & 3) == 2) { // two of a kind
    in->from[1] = NONE, in->latency = FLOAT;
    if ((word >> 12 & 0x1F) == 0x1F) in->unit = DIVIDE, in->latency = wide ? 38 : 12, in->busy = wide ? 35 : 9; // FSQRT
  } else { // permutations, copies, by element
    in->latency = 2;
    if ((word >> 24 & 0x1F) == 0x0F && (word >> 10 & 1) == 0) {
      unsigned operation = word >> 12 & 0xF;
      in->latency = FLOAT;
      if (operation == 9) in->unit = MULTIPLY;
      if (operation == 1 || operation == 5) in->unit = FUSED, in->latency = 2 * FLOAT, in->from[2] = d;
    }
  }
}

static void decode(Instruction *in, uint32_t word) {
  in->unit = ALU, in->latency = 1, in->busy = 1;
  memset(in->to, NONE, sizeof in->to);
  memset(in->from, NONE, sizeof in->from);
  unsigned kind = word >> 25 & 0xF;
  if ((kind & 5) == 4) {
    decode_memory(in, word);
  } else if ((kind & 7) == 7) {
    decode_vector(in, word);
  } else if ((kind & 0xE) == 0xA) {
    in->unit = BRANCH;
    if (word >> 24 == 0x54) in->from[0] = FLAGS;                                       // B.cond
    if ((word >> 25 & 0x3F) == 0x1A || (word >> 25 & 0x3F) == 0x1B) in->from[0] = integer(word & 31); // CBZ, TBZ
  } else if ((kind & 0xE) == 8) { // with a constant
    bool sets = (word >> 24 & 0x1F) == 0x11 ? word >> 29 & 1 : (word >> 23 & 0x3F) == 0x24 && (word >> 29 & 3) == 3;
    in->to[0] = word & 31, in->from[0] = word >> 5 & 31;
    if ((word >> 24 & 0x1F) == 0x10 || (word >> 23 & 0x3F) == 0x25) in->from[0] = NONE; // ADR, MOVZ
    if (sets) in->to[0] = integer(word & 31), in->to[1] = FLAGS;
  } else if ((kind & 7) == 5) { // of registers
    unsigned operation = word >> 21 & 0xF;
    bool other = word >> 28 & 1;
    in->to[0] = integer(word & 31), in->from[0] = integer(word >> 5 & 31), in->from[1] = integer(word >> 16 & 31);
    if (!other && ((word >> 24 & 1) ? word >> 29 & 1 : (word >> 29 & 3) == 3)) in->to[1] = FLAGS;
    if (other && operation == 2) in->to[0] = FLAGS, in->from[2] = FLAGS;  // CCMP
    if (other && operation == 4) in->from[2] = FLAGS;                     // CSEL
    if (other && operation == 6 && !(word >> 30 & 1) && (word >> 10 & 0x3E) == 2) in->unit = DIVIDE, in->latency = 12, in->busy = 10;
    if (other && operation >= 8) in->latency = 4, in->from[2] = integer(word >> 10 & 31); // MADD and its like
  }
}

// ---- Time
static double ready[REGISTERS], unit_free[UNITS], clock_now;
static unsigned issued;
static Instruction *pending;
static struct { uint64_t address; bool store; } accesses[8];
static unsigned access_count;
static int core = -1;

// Takes the time of the instruction whose accesses are known by now.
static void settle(void) {
  if (!pending) return;
  const Instruction *in = pending;
  double before = clock_now, at = clock_now, latency = in->latency;
  for (unsigned k = 0; k < 4; k++) if (in->from[k] != NONE && ready[in->from[k]] > at) at = ready[in->from[k]];
  unsigned unit = in->unit == STORE ? LOAD : in->unit;
  if (unit != ALU && unit_free[unit] > at) at = unit_free[unit];
  if (unit == FUSED && unit_free[ADD] > at) at = unit_free[ADD];
  if (unit == FUSED && unit_free[MULTIPLY] > at) at = unit_free[MULTIPLY];
  if (at > clock_now) clock_now = at, issued = 0;
  else if (issued == 2) clock_now += 1, issued = 0;
  issued++;
  if (unit != ALU) unit_free[unit] = clock_now + in->busy;
  if (unit == FUSED) unit_free[ADD] = unit_free[MULTIPLY] = clock_now + in->busy;
  double worst = 0;
  for (unsigned k = 0; k < access_count; k++) {
    double cost = miss(accesses[k].address, in->group, accesses[k].store);
    if (cost > worst) worst = cost;
  }
  // A load waits where its result is used; a line that streams in, and a store, hold the unit.
  if (in->unit == LOAD) latency += worst;
  if (in->unit == STORE || worst < MEMORY) unit_free[LOAD] += worst;
  for (unsigned k = 0; k < 2; k++) if (in->to[k] != NONE) ready[in->to[k]] = clock_now + latency;
  in->group->instructions++;
  in->group->clocks += clock_now - before;
  pending = NULL;
}

static void executes(unsigned on, void *instruction) {
  if (core < 0) core = on;
  if ((int)on != core) return;
  settle();
  pending = instruction;
  access_count = 0;
}

static void accesses_memory(unsigned on, uint32_t how, uint64_t address, void *instruction) {
  if ((int)on != core || pending != instruction || access_count == 8) return;
  accesses[access_count].address = address;
  accesses[access_count++].store = qemu_plugin_mem_is_store(how);
}

static Group *group_of(const char *symbol) {
  for (int at = 0; symbol && at < group_count; at++) {
    const Group *group = &groups[at];
    if (strstr(symbol, group->part) && !(group->unlike && strstr(symbol, group->unlike))) return &groups[at];
  }
  return NULL;
}

static void translates(plugin_id id, struct qemu_plugin_tb *block) {
  (void)id;
  for (size_t at = 0; at < qemu_plugin_tb_n_insns(block); at++) {
    struct qemu_plugin_insn *found = qemu_plugin_tb_get_insn(block, at);
    Group *group = group_of(qemu_plugin_insn_symbol(found));
    if (!group) continue;
    Instruction *in = calloc(1, sizeof *in);
    in->group = group;
    uint32_t word;
    memcpy(&word, qemu_plugin_insn_data(found), sizeof word);
    decode(in, word);
    qemu_plugin_register_vcpu_insn_exec_cb(found, executes, 0, in);
    qemu_plugin_register_vcpu_mem_cb(found, accesses_memory, 0, 3, in);
  }
}

// A line for each group: name, instructions, clocks, misses of both levels.
static void ends(plugin_id id, void *unused) {
  (void)id, (void)unused;
  settle();
  for (int at = 0; at < group_count; at++) {
    const Group *group = &groups[at];
    fprintf(stderr, "a53 %s %llu %.0f %llu %llu\n", group->name, (unsigned long long)group->instructions,
            group->clocks, (unsigned long long)group->first_misses, (unsigned long long)group->second_misses);
  }
}

EXPORT int qemu_plugin_install(plugin_id id, const void *info, int count, char **arguments) {
  (void)info;
  make(&first, 32 << 10, 4);
  make(&second, 1 << 20, 16);
  for (int at = 0; at < count; at++) {
    if (strncmp(arguments[at], "group=", 6) || group_count == GROUPS) return 1;
    Group *group = &groups[group_count++];
    group->name = strtok(strdup(arguments[at] + 6), ":");
    group->part = strtok(NULL, ":");
    group->unlike = strtok(NULL, ":");
    if (!group->part) return 1;
  }
  qemu_plugin_register_vcpu_tb_trans_cb(id, translates);
  qemu_plugin_register_atexit_cb(id, ends, NULL);
  return 0;
}
