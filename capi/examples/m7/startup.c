/* Start of an example on the emulated Cortex-M7 (QEMU's mps2-an500): stack, floating-point unit, static memory, then `main` with the words
 * that the emulator was given. Files and output are those of the host, by semihosting (newlib's librdimon). */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

extern uint32_t stack_top[], __bss_start__[], __bss_end__[];
void initialise_monitor_handles(void);
void __libc_init_array(void);
int main(int count, char **words);
void reset(void);
void _init(void);
void _fini(void);

void _init(void) {
}

void _fini(void) {
}

static void fault(void) {
    for (;;) {
    }
}

/* Operation and argument of a semihosting call. */
static int call_host(int operation, void *argument) {
    register int r0 __asm("r0") = operation;
    register void *r1 __asm("r1") = argument;
    __asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

/* A function of its own: nothing of floating point may run before the unit is on. */
static __attribute__((noinline, noreturn)) void run(void) {
    static char line[1024], *words[4];
    memset(__bss_start__, 0, (size_t)((char *)__bss_end__ - (char *)__bss_start__));
    initialise_monitor_handles();
    __libc_init_array();
    struct {
        char *line;
        uint32_t length;
    } asked = {line, sizeof line};
    int count = 0;
    if (call_host(0x15, &asked) == 0) /* SYS_GET_CMDLINE */
        for (char *word = strtok(line, " "); word != NULL && count < 4; word = strtok(NULL, " "))
            words[count++] = word;
    exit(main(count, words));
}

void reset(void) {
    /* CPACR: coprocessors 10 and 11. */
    *(volatile uint32_t *)0xE000ED88 |= 0xF << 20;
    __asm volatile("dsb\n isb");
    run();
}

__attribute__((section(".vectors"), used)) static const void *const vectors[16] = {
    stack_top, reset, fault, fault, fault, fault, fault,
};
