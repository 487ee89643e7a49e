// Measurements in a process and a network of their own, that ends at this computer: libraries of middlewares
// and their threads stay for as long as their process, and listen to all networks that it has.
#pragma once

#include "own_network.hpp"

#include <exception>
#include <optional>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

namespace bf::benchmarks {

/// What `measure` writes there. Nothing: it has not set `is_good` within a minute.
template <class Measured> std::optional<Measured> measured_alone(void (*measure)(Measured&)) {
    auto* shared = static_cast<Measured*>(
        mmap(nullptr, sizeof(Measured), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
    const pid_t child = fork();
    if (child == 0) {
        alarm(60);
        try {
            if (middleware::test::enter_network_of_our_own()) measure(*shared);
        } catch (const std::exception&) { // and it is not good
        }
        _exit(0);
    }
    waitpid(child, nullptr, 0);
    const Measured measured = *shared;
    munmap(shared, sizeof(Measured));
    return measured.is_good ? std::optional(measured) : std::nullopt;
}

} // namespace bf::benchmarks
