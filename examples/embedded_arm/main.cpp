// The generated class on a microcontroller: no operating system, no heap.
#include "lowpass.hpp"

#include <cstring>

/// A call of the debugger behind the processor (Arm semihosting), which QEMU answers.
static int semihosting(int operation, const void* argument) {
    register int r0 asm("r0") = operation;
    register const void* r1 asm("r1") = argument;
    asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static Lowpass model;

int main() {
    if (!model.initialize()) return 1;
    const double K = 0.2;
    if (model.set_parameter("K.K", &K, 1)) return 1;
    model.inputs.u = 1;
    for (int k = 0; k <= 10; ++k)
        if (!model.step()) return 1;
    // The bits of the result, so that a test can compare them.
    unsigned char bytes[sizeof model.outputs.y];
    std::memcpy(bytes, &model.outputs.y, sizeof bytes);
    char text[2 * sizeof bytes + 2] = {};
    for (unsigned i = 0; i < sizeof bytes; ++i) {
        text[2 * i] = "0123456789abcdef"[bytes[i] >> 4];
        text[2 * i + 1] = "0123456789abcdef"[bytes[i] & 15];
    }
    text[2 * sizeof bytes] = '\n';
    semihosting(0x04, text); // SYS_WRITE0
    return 0;
}

// ---- what stands before main on a Cortex-M: the vector table, and the memory that the linker script lays
// out

extern "C" {
extern unsigned char stack_top[], data_begin[], data_end[], data_load[], bss_begin[], bss_end[];
extern void (*init_begin[])();
extern void (*init_end[])();

[[noreturn]] void reset() {
    std::memcpy(data_begin, data_load, static_cast<std::size_t>(data_end - data_begin));
    std::memset(bss_begin, 0, static_cast<std::size_t>(bss_end - bss_begin));
    for (auto* init = init_begin; init != init_end; ++init) (*init)();
    const int code = main();
    const int exit[] = {0x20026, code}; // ADP_Stopped_ApplicationExit
    semihosting(0x20, exit);            // SYS_EXIT_EXTENDED
    for (;;) {
    }
}

[[gnu::section(".vectors"), gnu::used]] const void* const vectors[] = {stack_top,
                                                                       reinterpret_cast<const void*>(&reset)};
}
