/* A plugin of QEMU 7 and 8 (plugin interface, version 1) that writes how often each straight run of instructions was executed.

   Built:  cc -O2 -shared -fPIC -o profile.so instruction_profile.c
   Used:   qemu-system-arm ... -plugin profile.so,out=FILE,stack=FIRST-END

   A line `stage WAITS ENTRIES` for each piece of work: one for each `measure` of `checks/src/bin/receiver_an500/counts.rs`. What runs outside of them is
   counted nowhere: there the board waits for the host. Then, for each run, a line `block SYMBOL WAITS COUNT...` with its executions in each
   piece of work, and a line `  TEXT` for each of its instructions. WAITS are branches that were predicted wrongly and lines that the caches
   for code and for data did not have. */
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* What is used of QEMU's interface, declared here: not every system has a package of its header. */
typedef uint64_t plugin_id;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
typedef void (*on_translated)(plugin_id, struct qemu_plugin_tb *);
typedef void (*on_executed)(unsigned, void *);
typedef void (*on_memory)(unsigned, uint32_t, uint64_t, void *);
extern void qemu_plugin_register_vcpu_tb_trans_cb(plugin_id, on_translated);
extern void qemu_plugin_register_vcpu_tb_exec_cb(struct qemu_plugin_tb *, on_executed, int, void *);
extern void qemu_plugin_register_vcpu_mem_cb(struct qemu_plugin_insn *, on_memory, int, int, void *);
extern void qemu_plugin_register_atexit_cb(plugin_id, void (*)(plugin_id, void *), void *);
extern size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb *);
extern uint64_t qemu_plugin_tb_vaddr(const struct qemu_plugin_tb *);
extern struct qemu_plugin_insn *qemu_plugin_tb_get_insn(const struct qemu_plugin_tb *, size_t);
extern const char *qemu_plugin_insn_symbol(const struct qemu_plugin_insn *);
extern char *qemu_plugin_insn_disas(const struct qemu_plugin_insn *);
extern uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn *);
extern size_t qemu_plugin_insn_size(const struct qemu_plugin_insn *);
__attribute__((visibility("default"))) int qemu_plugin_version = 1;
enum { NO_REGISTERS = 0, READS_AND_WRITES = 3 };

/* Pieces of work; 0 is none. */
enum { STAGES = 24, UNCHANGED = -1 };
enum { MISPREDICTED, CODE_MISSES, DATA_MISSES, WAITS };

struct block {
    struct block *next;
    uint64_t start, end;
    size_t length;
    const char *symbol;
    char **texts;
    int stage; /* that begins with it, or UNCHANGED */
    uint8_t predictor;
    uint64_t waits[WAITS], counts[STAGES];
};

static struct block *blocks[1 << 16];
static struct block *last;
/* The first run of each: it is entered there. */
static struct block *stages[STAGES];
static int stage_count = 1, stage;
static uint64_t stage_waits[STAGES][WAITS];
static FILE *out;
static uint64_t stack_first, stack_end;

/* The caches of an STM32H743: 16 KiB each, lines of 32 bytes; two ways for code, four for data. The way that was used longest ago goes. */
enum { LINE = 5, MOST_WAYS = 4 };
struct cache {
    unsigned ways, sets;
    uint64_t lines[256][MOST_WAYS];
};
static struct cache code = {2, 256, {{0}}}, data = {4, 128, {{0}}};

static bool misses(struct cache *cache, uint64_t address) {
    uint64_t line = (address >> LINE) + 1, *ways = cache->lines[(address >> LINE) % cache->sets];
    unsigned way = 0;
    while (way < cache->ways && ways[way] != line)
        way++;
    bool missed = way == cache->ways;
    for (way -= missed; way > 0; way--)
        ways[way] = ways[way - 1];
    ways[0] = line;
    return missed;
}

static void wait_for(struct block *block, int kind) {
    block->waits[kind]++;
    stage_waits[stage][kind]++;
}

/* Branches are predicted by two bits each, as if there were room for all. */
static void executed(unsigned processor, void *argument) {
    struct block *block = argument;
    (void)processor;
    if (last && stage) {
        bool taken = block->start != last->end;
        if (taken != (last->predictor >= 2))
            wait_for(last, MISPREDICTED);
        if (taken)
            last->predictor += last->predictor < 3;
        else
            last->predictor -= last->predictor > 0;
    }
    last = block;
    if (block->stage != UNCHANGED)
        stage = block->stage;
    if (!stage)
        return;
    block->counts[stage]++;
    for (uint64_t at = block->start >> LINE << LINE; at < block->end; at += 1 << LINE)
        if (misses(&code, at))
            wait_for(block, CODE_MISSES);
}

static void accessed(unsigned processor, uint32_t info, uint64_t address, void *argument) {
    (void)processor;
    (void)info;
    (void)argument;
    if (stage && last && (address < stack_first || address >= stack_end) && misses(&data, address))
        wait_for(last, DATA_MISSES);
}

static int stage_of(struct block *block) {
    if (strstr(block->symbol, "3fly17h"))
        return 0;
    if (!strstr(block->symbol, "6Counts7measure"))
        return UNCHANGED;
    for (int known = 1; known < stage_count; known++)
        if (!strcmp(stages[known]->symbol, block->symbol))
            return known;
    if (stage_count == STAGES)
        abort();
    stages[stage_count] = block;
    return stage_count++;
}

static void translated(plugin_id id, struct qemu_plugin_tb *tb) {
    (void)id;
    uint64_t start = qemu_plugin_tb_vaddr(tb);
    size_t length = qemu_plugin_tb_n_insns(tb);
    struct block **place = &blocks[start >> 1 & 0xffff];
    while (*place && ((*place)->start != start || (*place)->length != length))
        place = &(*place)->next;
    struct block *block = *place;
    if (!block) {
        struct qemu_plugin_insn *final = qemu_plugin_tb_get_insn(tb, length - 1);
        const char *symbol = qemu_plugin_insn_symbol(qemu_plugin_tb_get_insn(tb, 0));
        *place = block = calloc(1, sizeof *block);
        block->start = start;
        block->end = qemu_plugin_insn_vaddr(final) + qemu_plugin_insn_size(final);
        block->length = length;
        block->symbol = strdup(symbol && *symbol ? symbol : "?");
        block->stage = stage_of(block);
        block->texts = calloc(length, sizeof *block->texts);
        for (size_t index = 0; index < length; index++)
            block->texts[index] = qemu_plugin_insn_disas(qemu_plugin_tb_get_insn(tb, index));
    }
    qemu_plugin_register_vcpu_tb_exec_cb(tb, executed, NO_REGISTERS, block);
    for (size_t index = 0; index < length; index++)
        qemu_plugin_register_vcpu_mem_cb(qemu_plugin_tb_get_insn(tb, index), accessed, NO_REGISTERS, READS_AND_WRITES, NULL);
}

static void write_waits(const char *name, const uint64_t *waits) {
    fputs(name, out);
    for (int kind = 0; kind < WAITS; kind++)
        fprintf(out, " %llu", (unsigned long long)waits[kind]);
}

static void ended(plugin_id id, void *argument) {
    (void)id;
    (void)argument;
    for (int one = 1; one < stage_count; one++) {
        write_waits("stage", stage_waits[one]);
        fprintf(out, " %llu\n", (unsigned long long)stages[one]->counts[one]);
    }
    for (size_t slot = 0; slot < sizeof blocks / sizeof *blocks; slot++)
        for (struct block *block = blocks[slot]; block; block = block->next) {
            fprintf(out, "block ");
            write_waits(block->symbol, block->waits);
            for (int one = 1; one < stage_count; one++)
                fprintf(out, " %llu", (unsigned long long)block->counts[one]);
            fputc('\n', out);
            for (size_t index = 0; index < block->length; index++)
                fprintf(out, "  %s\n", block->texts[index]);
        }
    fclose(out);
}

__attribute__((visibility("default"))) int qemu_plugin_install(plugin_id id, const void *info, int count, char **arguments) {
    (void)info;
    for (int index = 0; index < count; index++) {
        if (!strncmp(arguments[index], "out=", 4))
            out = fopen(arguments[index] + 4, "w");
        unsigned long long first, end;
        if (sscanf(arguments[index], "stack=%llx-%llx", &first, &end) == 2) {
            stack_first = first;
            stack_end = end;
        }
    }
    if (!out)
        return 1;
    qemu_plugin_register_vcpu_tb_trans_cb(id, translated);
    qemu_plugin_register_atexit_cb(id, ended, NULL);
    return 0;
}
