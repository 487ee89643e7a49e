// The generated model on a microcontroller: no operating system, no heap.
#include "lowpass.h"

#include <string.h>

/// A call of the debugger behind the processor (Arm semihosting), which QEMU answers.
static int semihosting(int operation, const void* argument) {
    register int r0 __asm__("r0") = operation;
    register const void* r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static lowpass_model model;

int main(void) {
    lowpass_set_defaults(&model);
    model.parameters.K_K = 0.2;
    if (!lowpass_initialize(&model)) return 1;
    model.inputs.u = 1;
    for (int k = 0; k <= 10; ++k)
        if (!lowpass_step(&model)) return 1;
    // The bits of the result, so that a test can compare them.
    unsigned char bytes[sizeof model.outputs.y];
    memcpy(bytes, &model.outputs.y, sizeof bytes);
    char text[2 * sizeof bytes + 2];
    for (unsigned i = 0; i < sizeof bytes; ++i) {
        text[2 * i] = "0123456789abcdef"[bytes[i] >> 4];
        text[2 * i + 1] = "0123456789abcdef"[bytes[i] & 15];
    }
    text[2 * sizeof bytes] = '\n';
    text[2 * sizeof bytes + 1] = '\0';
    semihosting(0x04, text); // SYS_WRITE0
    return 0;
}

// ---- what stands before main on a Cortex-M: the vector table, and the memory that the linker script lays
// out

extern unsigned char stack_top[], data_begin[], data_end[], data_load[], bss_begin[], bss_end[];

void reset(void);
void reset(void) {
    memcpy(data_begin, data_load, (size_t)(data_end - data_begin));
    memset(bss_begin, 0, (size_t)(bss_end - bss_begin));
    const int code = main();
    const int exit[] = {0x20026, code}; // ADP_Stopped_ApplicationExit
    semihosting(0x20, exit);            // SYS_EXIT_EXTENDED
    for (;;) {
    }
}

__attribute__((section(".vectors"), used)) static const void* const vectors[] = {stack_top, (const void*)&reset};
