// What every block must do, checked from its declaration alone.
#pragma once

#include "../../blocks/test/run_block.hpp"
#include "heap.hpp"

#include <cstring>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace bf::conformance {

using test::heap_calls;
using test::heap_is_counted;

/// One block with its inputs wired in one way.
struct Wiring {
    std::vector<Size> sizes; ///< of the inputs, in order
    std::vector<Type> types; ///< of the type symbols
};

/// What was tried and what was broken; a block that accepts no wiring at all is broken too.
struct Verdict {
    int wirings = 0;
    std::vector<std::string> broken; ///< each a sentence that begins with block and wiring
};

namespace detail {

using test::RunBlock;

inline std::vector<std::byte> bytes_of(RunBlock& run, int slot) {
    const Slot& s = run.resolution().slots[static_cast<std::size_t>(slot)];
    const auto* data = static_cast<const std::byte*>(run.context().data(0, slot));
    return {data, data + s.size.count() * bytes(s.type)};
}
inline std::vector<std::byte> next_of(RunBlock& run, int slot) {
    const Slot& s = run.resolution().slots[static_cast<std::size_t>(slot)];
    const auto* data = static_cast<const std::byte*>(run.context().next_data(0, slot));
    return {data, data + s.size.count() * bytes(s.type)};
}

/// Two patterns that no honest output equals both times.
inline void fill(void* data, const Slot& s, int pattern) {
    // A bool may hold 0 or 1 only.
    const int byte = s.type == Type::boolean ? pattern & 1 : pattern;
    std::memset(data, byte, static_cast<std::size_t>(s.size.count() * bytes(s.type)));
}
inline constexpr int patterns[] = {0xAB, 0x54};

/// Random inputs; square matrices are symmetric and positive definite, so that every solver accepts them.
inline void randomise(RunBlock& run, std::mt19937& random) {
    std::normal_distribution<double> normal;
    for (std::size_t i = 0; i < run.resolution().slots.size(); ++i) {
        const Slot& s = run.resolution().slots[i];
        if (s.role != Role::input) continue;
        Matrix value(s.size.rows, s.size.cols);
        for (int k = 0; k < s.size.count(); ++k) value.data()[k] = normal(random);
        if (s.size.rows == s.size.cols && s.size.rows > 1)
            value = (value * value.transpose() + Matrix::Identity(s.size.rows, s.size.cols)).eval();
        if (s.type != Type::float64 && s.type != Type::float32 && s.type != Type::boolean) value *= 10;
        write_values(run.context().data(0, static_cast<int>(i)), s.type, s.size.count(),
                     {value.data(), value.data() + value.size()});
    }
}

/// Values of all outputs and states.
inline std::vector<std::vector<std::byte>> observe(RunBlock& run) {
    std::vector<std::vector<std::byte>> all;
    for (std::size_t i = 0; i < run.resolution().slots.size(); ++i)
        if (const Role role = run.resolution().slots[i].role; role == Role::output || is_state(role))
            all.push_back(bytes_of(run, static_cast<int>(i)));
    return all;
}

/// Five steps with the random inputs of `seed`. A step may fail, e.g. on an index outside a table.
inline std::vector<std::vector<std::vector<std::byte>>> five_steps(RunBlock& run, unsigned seed) {
    std::mt19937 random(seed);
    std::vector<std::vector<std::vector<std::byte>>> seen;
    for (int i = 0; i < 5; ++i) {
        randomise(run, random);
        const bool good = bool(run.output()) && bool(run.update());
        if (good) run.commit();
        seen.push_back(observe(run));
    }
    return seen;
}

inline void check_wired(RunBlock& run, const std::string& where, Verdict& verdict) {
    const auto broken = [&](const std::string& what) { verdict.broken.push_back(where + ": " + what); };
    const auto& slots = run.resolution().slots;
    const int count = static_cast<int>(slots.size());
    const auto role = [&](int i) { return slots[static_cast<std::size_t>(i)].role; };
    const auto name_of = [&](int i) { return "'" + slots[static_cast<std::size_t>(i)].name + "'"; };
    // Whether a default also fits the type that this wiring gives the parameter is asked of models: some must
    // give a value then.
    for (const Slot& s : slots)
        if (const auto wrong = outside(s.limits, s.initial.empty() ? std::vector<double>{0} : s.initial);
            s.role == Role::parameter && !wrong.empty())
            broken("its own default: " + wrong);

    std::mt19937 random(7);
    randomise(run, random);
    std::vector<std::vector<std::byte>> before(slots.size()), outputs[2], next_states[2];
    bool is_good = true;
    for (int round = 0; round < 2; ++round) {
        for (int i = 0; i < count; ++i) {
            if (role(i) == Role::output)
                fill(run.context().data(0, i), slots[static_cast<std::size_t>(i)], patterns[round]);
            if (role(i) == Role::discrete_state)
                fill(run.context().next_data(0, i), slots[static_cast<std::size_t>(i)], patterns[round]);
            before[static_cast<std::size_t>(i)] = bytes_of(run, i);
        }
        const long heap = heap_calls();
        const bool output_good = bool(run.output());
        const long heap_output = heap_calls() - heap;
        for (int i = 0; i < count; ++i) {
            outputs[round].push_back(bytes_of(run, i));
            if (role(i) != Role::output && role(i) != Role::workspace &&
                before[static_cast<std::size_t>(i)] != outputs[round].back())
                broken("output writes " + std::string(name(role(i))) + " " + name_of(i));
        }
        const long heap_2 = heap_calls();
        const bool update_good = bool(run.update());
        const long heap_update = heap_calls() - heap_2;
        if (heap_output > 0 && round == 0) broken("output uses the heap");
        if (heap_update > 0 && round == 0) broken("update uses the heap");
        is_good = is_good && output_good && update_good;
        for (int i = 0; i < count; ++i) {
            if (role(i) == Role::discrete_state)
                next_states[round].push_back(next_of(run, i));
            else
                next_states[round].emplace_back();
            if (role(i) != Role::workspace && outputs[round][static_cast<std::size_t>(i)] != bytes_of(run, i))
                broken("update writes " + std::string(name(role(i))) + " " + name_of(i));
        }
    }
    // With two patterns before, what differs after was not written, or depends on something hidden.
    for (int i = 0; i < count; ++i) {
        const auto k = static_cast<std::size_t>(i);
        const auto is_left = [&](const std::vector<std::byte>* seen) {
            std::vector<std::byte> pattern(seen[0].size());
            fill(pattern.data(), slots[k], patterns[0]);
            const auto size = static_cast<std::size_t>(bytes(slots[k].type));
            for (std::size_t e = 0; e < seen[0].size(); e += size)
                if (!std::equal(&seen[0][e], &seen[0][e] + size, &seen[1][e]))
                    return std::equal(&seen[0][e], &seen[0][e] + size, &pattern[e]) ? 1 : 2;
            return 0;
        };
        const std::vector<std::byte> out[] = {outputs[0][k], outputs[1][k]};
        const std::vector<std::byte> next[] = {next_states[0][k], next_states[1][k]};
        if (role(i) == Role::output) {
            if (is_left(out) == 1) broken("output leaves output " + name_of(i) + " unwritten");
            if (is_left(out) == 2) broken("same inputs give another output " + name_of(i));
        }
        if (role(i) == Role::discrete_state && is_good) {
            if (is_left(next) == 1) broken("update leaves the next state " + name_of(i) + " unwritten");
            if (is_left(next) == 2) broken("same inputs give another next state " + name_of(i));
        }
    }

    run.reset();
    const auto first_run = five_steps(run, 1);
    if (run.context().refuses_snapshot() < 0) {
        std::vector<std::byte> snapshot(run.context().snapshot_size());
        run.context().save(snapshot.data());
        const auto went_on = five_steps(run, 2);
        run.context().restore(snapshot.data());
        if (five_steps(run, 2) != went_on) broken("after restoring a snapshot it goes on differently");
    }
    run.reset();
    if (five_steps(run, 1) != first_run) broken("after a reset it runs differently");
}

inline std::string text(const Wiring& wiring) {
    std::string all;
    for (const auto& size : wiring.sizes) all += (all.empty() ? "" : ", ") + size.text();
    for (const Type type : wiring.types) all += std::string(all.empty() ? "" : ", ") + bf::name(type);
    return all.empty() ? "as declared" : all;
}

/// Wires the inputs in turn; false when the block refuses.
inline bool wire(RunBlock& run, const Wiring& wiring) {
    try {
        Resolution& r = run.instance().block().resolution();
        std::size_t k = 0;
        for (std::size_t i = 0; i < r.slots.size(); ++i) {
            const Slot& s = r.slots[i];
            if (s.role != Role::input && s.role != Role::output && s.role != Role::parameter) continue;
            if (s.type_symbol >= 0 && static_cast<std::size_t>(s.type_symbol) < wiring.types.size())
                offer(r, static_cast<int>(i), wiring.types[static_cast<std::size_t>(s.type_symbol)]);
            if (s.role == Role::input && k < wiring.sizes.size())
                offer(r, static_cast<int>(i), wiring.sizes[k++]);
        }
        propagate(run.instance().block());
        if (k == 0) // a source whose reader decides
            for (std::size_t i = 0; i < r.slots.size(); ++i)
                if (r.slots.size() == 1 && r.slots[i].role == Role::output && !r.slots[i].size_known)
                    offer(r, static_cast<int>(i), Size{3, 1, false});
        run.start();
        return true;
    } catch (const ResolutionError&) {
        return false;
    }
}

/// Every combination of `choices` for `places` places.
template <class T> std::vector<std::vector<T>> combinations(const std::vector<T>& choices, int places) {
    std::vector<std::vector<T>> all{{}};
    for (int i = 0; i < places; ++i) {
        std::vector<std::vector<T>> longer;
        for (const auto& start : all)
            for (const auto& choice : choices) {
                longer.push_back(start);
                longer.back().push_back(choice);
            }
        all = std::move(longer);
    }
    return all;
}

inline void check_description(const RunBlock& run, const std::string& where, Verdict& verdict) {
    static const std::set<std::string> obvious{"u", "y", "u1", "u2", "u3", "y1", "y2", "x"};
    std::set<std::pair<Role, std::string>> names;
    for (const auto& slot : run.resolution().slots) {
        const auto what = where + ": " + name(slot.role) + " '" + slot.name + "' ";
        if (slot.name.empty()) verdict.broken.push_back(what + "has no name");
        if (slot.doc.empty() && slot.role != Role::workspace && !obvious.contains(slot.name))
            verdict.broken.push_back(what + "has no doc");
        if (!names.insert({slot.role, slot.name}).second)
            verdict.broken.push_back(what + "is declared twice");
    }
    // A model file says these of every block, so no block can be given its own.
    static const std::set<std::string> taken{"block", "doc", "period", "offset"};
    for (const auto& slot : run.resolution().slots)
        if (slot.role == Role::parameter && taken.contains(slot.name))
            verdict.broken.push_back(where + ": parameter '" + slot.name + "' cannot be set in a model file");
    for (const auto& argument : run.declaration().arguments)
        if (argument.name.empty() || argument.doc.empty())
            verdict.broken.push_back(where + ": argument '" + argument.name + "' has no name or no doc");
}

} // namespace detail

/// Checks one class of blocks, made with `arguments`, in every wiring that it accepts among scalars, [3], 3x3
/// and [4], 4x4 for each input (up to three inputs; alike for more) and, in the first accepted one, every
/// element type: every slot named and documented; every output and next state written; nothing else touched;
/// no heap; same inputs, same outputs; snapshots and resets exact.
inline Verdict check_contract(const BlockClass& block_class, const Arguments& arguments = {}) {
    using namespace detail;
    Verdict verdict;
    const std::string title = block_class.qualified_name();
    const RunBlock described(block_class, arguments);
    check_description(described, title, verdict);
    if (block_class.doc.empty()) verdict.broken.push_back(title + ": the class has no doc");

    int inputs = 0;
    for (const auto& slot : described.resolution().slots) inputs += slot.role == Role::input;
    const int symbols = described.declaration().types;
    const std::vector<Size> sizes{{}, {3, 1, false}, {3, 3, true}, {4, 1, false}, {4, 4, true}};
    std::vector<std::vector<Size>> wirings;
    if (inputs <= 3)
        wirings = combinations(sizes, inputs);
    else
        for (const auto& size : sizes) wirings.emplace_back(static_cast<std::size_t>(inputs), size);
    std::vector<Type> types;
    for (int i = 0; i < type_count; ++i) types.push_back(static_cast<Type>(i));

    const auto attempt = [&](const Wiring& wiring) {
        RunBlock run(block_class, arguments);
        if (!wire(run, wiring)) return false;
        ++verdict.wirings;
        check_wired(run, title + " (" + text(wiring) + ")", verdict);
        return true;
    };
    const auto all_types = combinations(types, symbols);
    for (const auto& choice : wirings) {
        std::size_t t = 0; // the first types that this block accepts
        while (t < all_types.size() && !attempt({choice, all_types[t]})) ++t;
        const bool is_first_accepted = t < all_types.size() && verdict.wirings == 1;
        if (is_first_accepted)
            for (++t; t < all_types.size(); ++t) attempt({choice, all_types[t]});
    }
    if (verdict.wirings == 0) verdict.broken.push_back(title + ": accepts none of the wirings tried");
    return verdict;
}

} // namespace bf::conformance
