#include "machine.hpp"
#include "succession.hpp"

#include <algorithm>
#include <cstring>
#include <limits>

namespace bf {

Simulation::Simulation(const Diagram& diagram) : Simulation(diagram, nullptr, {}) {}

Simulation::Simulation(const Diagram& diagram, std::unique_ptr<Succession> succession, const Origin& origin)
    : diagram_(diagram), succession_(std::move(succession)),
      context_(succession_ ? succession_->context_nodes(diagram) : diagram.context_nodes(),
               static_cast<int>(diagram.rates.size())),
      program_(program::lower(diagram)), is_elsewhere_(diagram.nodes.size()) {
    bind_guards();
    if (!context_.continuous_state().empty()) {
        find_held(diagram_.needed_inside_a_step());
        find_seen();
        solver_ = make_solver(diagram_.solver, diagram_.step, continuous_system());
    }
    machine_ = std::make_unique<Machine>(*this);
    if (!succession_) return;
    is_elsewhere_ = succession_->is_kept;
    succession_->find_copies(*this, origin);
}

Simulation::~Simulation() { stop(); }

bool Simulation::is_hit(int rate) const {
    const auto& r = diagram_.rates[static_cast<std::size_t>(rate)];
    if (shows_event_ && r.trigger == 0) return r.is_continuous;
    return rate != constant_rate && machine_->flag(program_.hit[static_cast<std::size_t>(rate)]) != 0;
}

int Simulation::owner(Role role, const double* element) noexcept {
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n) {
        const auto& slots = diagram_.nodes[n].block->resolution().slots;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            if (slots[i].role != role || slots[i].type != Type::float64) continue;
            const int node = static_cast<int>(n), slot = static_cast<int>(i);
            const auto* begin = static_cast<const double*>(
                role == Role::discrete_state ? context_.next_data(node, slot) : context_.data(node, slot));
            if (begin <= element && element < begin + slots[i].size.count()) return node;
        }
    }
    return -1;
}

/// Root inputs keep what was written to them before the start.
void Simulation::clear_outputs() {
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n) {
        const Block& block = *diagram_.nodes[n].block;
        if (block.declaration().traits.is_root_input) continue;
        const auto& slots = block.resolution().slots;
        for (std::size_t i = 0; i < slots.size(); ++i)
            if (slots[i].role == Role::output)
                std::memset(context_.data(static_cast<int>(n), static_cast<int>(i)), 0,
                            static_cast<std::size_t>(slots[i].size.count() * bytes(slots[i].type)));
    }
}

void Simulation::start() {
    stop();
    steps_ = 0;
    status_ = ok;
    failed_node_ = -1;
    for (std::size_t r = 0; r < diagram_.rates.size(); ++r) {
        const bool is_continuous = diagram_.rates[r].is_continuous;
        context_.clock(static_cast<int>(r)) = {0, is_continuous ? 0 : diagram_.period(static_cast<int>(r)),
                                               -1};
    }
    machine_->forget();
    std::fill(guard_before_.begin(), guard_before_.end(), std::numeric_limits<double>::quiet_NaN());
    std::fill(edges_.begin(), edges_.end(), 0.0);
    for (auto& guard : guard_bindings_) guard.recent = {};
    if (solver_) solver_->set_history(0, {});
    must_restart_ = true;
    is_at_event_ = false;
    clear_outputs();
    std::fill(context_.continuous_rate().begin(), context_.continuous_rate().end(), 0.0);
    start_failure_.clear();
    if (machine_->run(machine_->start)) return;
    const std::string why = start_failure_.empty() ? failure() : start_failure_;
    stop();
    throw RunError(why);
}

bool Simulation::start_blocks() noexcept {
    const int nodes = static_cast<int>(diagram_.nodes.size());
    for (; started_ < nodes; ++started_) try {
            if (!is_elsewhere_[static_cast<std::size_t>(started_)]) context_.start(started_);
        } catch (const std::exception& error) {
            start_failure_ = diagram_.nodes[static_cast<std::size_t>(started_)].path + ": " + error.what();
            return false;
        }
    return true;
}

void Simulation::observe() noexcept {
    show();
    for (auto& seen : seen_) std::memcpy(seen.last.data(), seen.now, seen.last.size());
}

void Simulation::show_what_was_seen() noexcept {
    for (const auto& seen : seen_) std::memcpy(seen.now, seen.last.data(), seen.last.size());
}

Status Simulation::step() noexcept {
    if (!status_ || !machine_->run(machine_->step)) return status_;
    observe();
    if (!machine_->run(machine_->update)) return status_;
    ++steps_;
    return ok;
}

bool Simulation::fail(Status status, int node) noexcept {
    status_ = status;
    failed_node_ = node;
    return false;
}

void Simulation::stop() noexcept {
    for (; started_ > 0; --started_)
        if (!is_elsewhere_[static_cast<std::size_t>(started_ - 1)]) context_.stop(started_ - 1);
}

std::string Simulation::failure() const {
    if (status_) return {};
    if (failed_node_ < 0) return status_.text();
    const auto& node = diagram_.nodes[static_cast<std::size_t>(failed_node_)];
    return node.path + ": " + status_.text(&node.block->resolution());
}

std::vector<CheckResult> Simulation::checks() const {
    std::vector<CheckResult> results;
    for (const auto& check : diagram_.checks()) {
        const Type type = diagram_.slot(check.end).type;
        const void* data = context_.data(check.end.node, check.end.slot);
        results.push_back({check.path, read_value(data, type, 0), type == Type::boolean});
    }
    return results;
}

std::vector<std::span<std::byte>> Simulation::state() {
    std::vector<std::span<std::byte>> parts{std::as_writable_bytes(std::span(&steps_, 1)),
                                            std::as_writable_bytes(std::span(guard_before_)),
                                            std::as_writable_bytes(std::span(edges_))};
    for (const auto part : machine_->state()) parts.push_back(part);
    for (auto& guard : guard_bindings_) parts.push_back(std::as_writable_bytes(std::span(&guard.recent, 1)));
    for (auto& held : held_) parts.emplace_back(held.last);
    return parts;
}

std::vector<std::byte> Simulation::snapshot() const {
    if (const int node = context_.refuses_snapshot(); node >= 0)
        throw RunError(diagram_.nodes[static_cast<std::size_t>(node)].path +
                       ": its state lives outside and cannot be saved");
    std::vector<std::byte> bytes(context_.snapshot_size());
    context_.save(bytes.data());
    const auto put = [&](std::span<const std::byte> part) {
        bytes.insert(bytes.end(), part.begin(), part.end());
    };
    for (const auto part : const_cast<Simulation*>(this)->state()) put(part);
    if (solver_) {
        const std::vector<double> history = solver_->history();
        if (history.empty()) solver_->restart(time()); // both go on from here alike
        const double header[] = {static_cast<double>(history.size()), must_restart_ ? 1.0 : 0.0};
        put(std::as_bytes(std::span(header)));
        put(std::as_bytes(std::span(history)));
    }
    if (tuning_) {
        const std::vector<double> changed = tuning_->save();
        put(std::as_bytes(std::span(changed)));
    }
    return bytes;
}

void Simulation::restore(const std::vector<std::byte>& snapshot) {
    const auto parts = state();
    std::size_t fixed = context_.snapshot_size();
    for (const auto part : parts) fixed += part.size();
    const std::byte* from = snapshot.data();
    double header[2] = {}; // size of the solver's history, must it restart
    if (solver_) fixed += sizeof(header);
    if (solver_ && snapshot.size() >= fixed)
        std::memcpy(header, from + fixed - sizeof(header), sizeof(header));
    std::vector<double> history(static_cast<std::size_t>(
        std::clamp(header[0], 0.0, static_cast<double>(snapshot.size() / sizeof(double)))));
    fixed += history.size() * sizeof(double);
    std::vector<double> changed((snapshot.size() - std::min(fixed, snapshot.size())) / sizeof(double));
    if (snapshot.size() != fixed + changed.size() * sizeof(double))
        throw RunError("the snapshot has " + std::to_string(snapshot.size()) +
                       " bytes, but this diagram's have " + std::to_string(fixed) +
                       "; it belongs to another model");
    if (changed.empty()) {
        tuning_.reset();
    } else {
        std::memcpy(changed.data(), from + fixed, changed.size() * sizeof(double));
        try {
            tuning().restore(changed);
        } catch (const TuningError& error) {
            throw RunError("the snapshot belongs to another model: " + std::string(error.what()));
        }
    }
    context_.restore(from);
    from += context_.snapshot_size();
    for (const auto part : parts) {
        if (!part.empty()) std::memcpy(part.data(), from, part.size()); // no bytes may have no address
        from += part.size();
    }
    if (solver_) {
        from += sizeof(header);
        if (!history.empty()) std::memcpy(history.data(), from, history.size() * sizeof(double));
        solver_->set_history(time(), history);
        must_restart_ = header[1] != 0;
    }
    const auto rates = context_.continuous_rate();
    std::fill(rates.begin(), rates.end(), 0.0); // where nothing runs, states rest
    is_at_event_ = false;
    status_ = ok;
    failed_node_ = -1;
}

} // namespace bf
