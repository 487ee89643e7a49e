// bf_fuzz: tries models of chance.
#include "cases.hpp"

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <thread>
#include <unistd.h>
#include <vector>

namespace {

constexpr const char* usage =
    "bf_fuzz [--first SEED] [--count N] [--seconds S] [--threads N] [--print SEED] [--file FILE]\n"
    "Tries models of chance; ends with exit code 1 at the first that does what it must not. --seconds ends "
    "earlier,\n"
    "--print shows a model, --file tries a text as seed --first. The last line is the same for every number "
    "of threads.\n";

struct Options {
    std::uint64_t first = 0, count = 600, threads = 1;
    double seconds = 1e9;
};

/// The seed on which a crash or a hang would stop.
thread_local char message[96];
std::atomic<std::uint64_t> watched{0};

int report(std::uint64_t seed, const std::string& violation) {
    std::fprintf(stderr, "seed %llu: %s\nbf_fuzz --print %llu shows the model\n",
                 static_cast<unsigned long long>(seed), violation.c_str(),
                 static_cast<unsigned long long>(seed));
    return 1;
}

int run(const Options& options) {
    using Clock = std::chrono::steady_clock;
    const auto begin = Clock::now();
    std::atomic<std::uint64_t> next{options.first};
    std::atomic<bool> is_wrong{false};
    std::vector<std::map<std::uint64_t, bf::fuzz::Outcome>> outcomes(options.threads);
    std::vector<std::thread> threads;
    for (std::uint64_t t = 0; t < options.threads; ++t)
        threads.emplace_back([&, t] {
            while (!is_wrong &&
                   std::chrono::duration<double>(Clock::now() - begin).count() < options.seconds) {
                const std::uint64_t seed = next++;
                if (seed >= options.first + options.count) return;
                watched = seed;
                auto outcome = bf::fuzz::try_model(bf::fuzz::model_of(seed), seed);
                if (!outcome.violation.empty()) is_wrong = true;
                outcomes[t][seed] = std::move(outcome);
            }
        });
    for (auto& thread : threads) thread.join();
    for (std::uint64_t t = 1; t < options.threads; ++t) outcomes[0].merge(outcomes[t]);
    std::uint64_t accepted = 0, hash = 0;
    for (const auto& [seed, outcome] : outcomes[0]) {
        if (!outcome.violation.empty()) return report(seed, outcome.violation);
        accepted += outcome.is_accepted;
        hash = hash * 31 + outcome.hash;
    }
    std::printf("%zu models, %llu ran, hash %016llx\n", outcomes[0].size(),
                static_cast<unsigned long long>(accepted), static_cast<unsigned long long>(hash));
    return 0;
}

extern "C" void tell_and_end(int signal) {
    const int length = std::snprintf(message, sizeof message, "signal %d at or near seed %llu\n", signal,
                                     static_cast<unsigned long long>(watched.load()));
    static_cast<void>(!::write(STDERR_FILENO, message, static_cast<std::size_t>(length)));
    std::signal(signal, SIG_DFL);
    std::raise(signal);
}

} // namespace

int main(int argc, char** argv) {
    Options options;
    for (int i = 1; i < argc; ++i) {
        const std::string option = argv[i], value = i + 1 < argc ? argv[++i] : "";
        const std::uint64_t number = std::strtoull(value.c_str(), nullptr, 10);
        if (option == "--first")
            options.first = number;
        else if (option == "--count")
            options.count = number;
        else if (option == "--threads")
            options.threads = number;
        else if (option == "--seconds")
            options.seconds = std::strtod(value.c_str(), nullptr);
        else if (option == "--print")
            return std::fputs(bf::fuzz::model_of(number).c_str(), stdout) < 0;
        else if (option == "--file") {
            std::ifstream file(value, std::ios::binary);
            const std::string text{std::istreambuf_iterator<char>(file), {}};
            const auto outcome = bf::fuzz::try_model(text, options.first);
            return outcome.violation.empty() ? 0 : report(options.first, outcome.violation);
        } else {
            std::fputs(usage, stderr);
            return 2;
        }
    }
    for (const int signal : {SIGABRT, SIGSEGV, SIGFPE, SIGTERM}) std::signal(signal, tell_and_end);
    return run(options);
}
