// A running model as functions of C, written by hand: it counts, and writes down what is called.
#pragma once

#include "bf/run/run_c.h"

#include <cstring>
#include <string>
#include <vector>

struct bf_run_model {
    double u = 0, y = 0, gain = 2, k = 4, error = 0.25;
    double w[3] = {1, 2, 3};
    float matrix[6] = {1, 2, 3, 4, 5, 6};
    bool has_counted = true, has_memory = true;
    std::int64_t steps = 0;
    std::string calls; ///< the first letter of each
    char fails = 0;    ///< that call
    const char *failed_block = nullptr, *failure = nullptr;
    void (*call)(void* with) = nullptr;
    void* with = nullptr;

    bool called(char letter) {
        calls += letter;
        if (letter == fails) failed_block = "counter", failure = "it lost count";
        return letter != fails;
    }
};

namespace bf::test {

/// y = gain (steps + u). In its second step there is an event.
inline bf_run_library counting_run() {
    static constexpr bf_run_rate rates[] = {
        {0, false, false}, {0.5, false, false}, {0.5, true, false}, {0.5, false, true}};
    static constexpr bf_run_panel plots[] = {{"Both", "counter.y\nm.y"}, {"One", "m.y"}};
    static constexpr bf_run_name names[] = {{0, "off"}, {2, "on"}};
    bf_run_library all{};
    all.name = "counting";
    all.period = 0.5;
    all.stop_time = 30;
    all.fingerprint = 77;
    all.rates = rates;
    all.rate_count = 4;
    all.plots = plots;
    all.plot_count = 2;
    all.snapshot_size = sizeof(std::int64_t);
    all.quantity = [](bf_run_model* m, bf_run_table table, int number, bf_run_quantity* row) {
        const std::vector<bf_run_quantity> rows[] = {
            {{"counter.y", "rad", "a count", 0, 1, 1, false, 1, names, 2, "", &m->y},
             {"m.y", "1", "", 1, 2, 3, true, 2, nullptr, 0, "", m->matrix}},
            {{"u", "1", "", 0, 1, 1, false, 1, nullptr, 0, "", &m->u}},
            {{"counter.gain", "1", "", 0, 1, 1, false, 0, nullptr, 0, "", &m->gain},
             {"v.w", "1", "", 0, 3, 1, false, 0, nullptr, 0, "left\n\nright", m->w}},
            {{"k", "1", "", 0, 1, 1, false, 0, nullptr, 0, "", &m->k}},
            {{"has_counted", "1", "", 8, 1, 1, false, 1, nullptr, 0, "", &m->has_counted},
             {"error", "1", "", 0, 1, 1, false, 1, nullptr, 0, "", &m->error}}};
        if (number >= static_cast<int>(rows[table].size())) return false;
        *row = rows[table][static_cast<std::size_t>(number)];
        return true;
    };
    all.destroy = [](bf_run_model* m) { m->called('d'); };
    all.on_event = [](bf_run_model* m, void (*call)(void*), void* with) { m->call = call, m->with = with; };
    all.initialize = [](bf_run_model* m) { return m->called('i'); };
    all.output = [](bf_run_model* m) {
        m->y = m->gain * (static_cast<double>(m->steps) + m->u);
        if (m->steps == 1 && m->call) m->call(m->with);
        return m->called('o');
    };
    all.update = [](bf_run_model* m) {
        ++m->steps;
        return m->called('u');
    };
    all.terminate = [](bf_run_model* m) { m->called('t'); };
    all.steps = [](const bf_run_model* m) { return m->steps; };
    all.is_hit = [](const bf_run_model* m, int rate) { return rate < 3 || m->steps % 2 == 1; };
    all.failed_block = [](const bf_run_model* m) { return m->failed_block; };
    all.failure = [](const bf_run_model* m) { return m->failure; };
    all.set_parameters = [](bf_run_model* m, const bf_run_value* changes, int count) -> const char* {
        for (int i = 0; i < count; ++i)
            if (changes[i].values[0] < 0) return "it must not be negative";
        for (int i = 0; i < count; ++i)
            std::memcpy(std::strcmp(changes[i].name, "v.w") == 0 ? m->w : &m->gain, changes[i].values,
                        static_cast<std::size_t>(changes[i].count) * sizeof(double));
        return nullptr;
    };
    all.save = [](const bf_run_model* m, void* bytes) { std::memcpy(bytes, &m->steps, sizeof m->steps); };
    all.restore = [](bf_run_model* m, const void* bytes) { std::memcpy(&m->steps, bytes, sizeof m->steps); };
    return all;
}

} // namespace bf::test
