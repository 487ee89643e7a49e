#include "states.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace bf {

Simulation::Simulation(const Diagram& diagram)
    : diagram_(diagram), context_(diagram.context_nodes(), static_cast<int>(diagram.rates.size())),
      hit_(diagram.rates.size()), hit_at_event_(diagram.rates.size()), until_hit_(diagram.rates.size()) {
    bind_conditions();
    bind();
}

Simulation::~Simulation() { stop(); }

Simulation::BoundSegment Simulation::bound(const Segment& segment, Phase phase) {
    BoundSegment result{segment.rate, segment.condition, {}, {}};
    for (const auto& activity : segment.activities) {
        result.tasks.push_back(activity.node >= 0   ? context_.task(activity.node, phase, activity.index)
                               : activity.loop >= 0 ? loop_task(activity.loop)
                                                    : condition_task(activity.condition));
        result.nodes.push_back(activity.node);
    }
    return result;
}

std::vector<Simulation::BoundSegment> Simulation::bound(const std::vector<Segment>& segments, Phase phase) {
    std::vector<BoundSegment> result;
    for (const auto& segment : segments) result.push_back(bound(segment, phase));
    return result;
}

void Simulation::bind() {
    bind_loops();
    for (const auto& segment : diagram_.plan.outputs)
        (segment.rate == constant_rate ? constants_ : outputs_).push_back(bound(segment, Phase::output));
    updates_ = bound(diagram_.plan.updates, Phase::update);
    for (const auto& segment : diagram_.plan.updates) commits_.push_back(commits_of(segment));
    derivatives_ = bound(diagram_.plan.derivatives, Phase::derivative);
    guards_ = bound(diagram_.plan.guards, Phase::guards);
    if (diagram_.refuses_non_finite)
        for (const auto& [end, number, rate, condition] : diagram_.real_outputs()) {
            const Slot& slot = diagram_.slot(end);
            watched_.push_back({rate, condition, end.node, context_.data(end.node, end.slot), slot.type,
                                slot.size.count(), number});
        }
    bind_guards();
    if (context_.continuous_state().empty()) return;
    const auto is_needed = diagram_.needed_inside_a_step();
    find_held(is_needed);
    find_seen();
    bind_minor_outputs(is_needed);
    must_finish_outputs_ = is_adaptive(diagram_.solver.method) &&
                           std::any_of(outputs_.begin(), outputs_.end(), [&](const auto& segment) {
                               return segment.condition > 0 &&
                                      diagram_.rates[static_cast<std::size_t>(segment.rate)].is_continuous;
                           });
    solver_ = make_solver(diagram_.solver, diagram_.step, continuous_system());
}

Simulation::CommitSegment Simulation::commits_of(const Segment& segment) {
    CommitSegment result{segment.rate, segment.condition, {}};
    auto& commits = result.commits;
    int last = -1;
    for (const auto& activity : segment.activities) {
        if (activity.node == last) continue;
        last = activity.node;
        const auto& slots = diagram_.nodes[static_cast<std::size_t>(last)].block->declaration().slots;
        for (std::size_t i = 0; i < slots.size(); ++i) {
            if (slots[i].role != Role::discrete_state) continue;
            const Commit next{static_cast<std::byte*>(context_.data(last, static_cast<int>(i))),
                              static_cast<const std::byte*>(context_.next_data(last, static_cast<int>(i))),
                              static_cast<std::size_t>(slots[i].size.count() * bytes(slots[i].type)),
                              slots[i].type == Type::float64};
            Commit* before = commits.empty() ? nullptr : &commits.back();
            if (before && before->is_double == next.is_double && before->to + before->bytes == next.to &&
                before->from + before->bytes == next.from)
                before->bytes += next.bytes;
            else
                commits.push_back(next);
        }
    }
    return result;
}

bool Simulation::run(const BoundSegment& segment) noexcept {
    const Task* const begin = segment.tasks.data();
    const Task* const end = begin + segment.tasks.size();
    for (const Task* task = begin; task != end; ++task)
        if (const Status status = (*task)(); !status) [[unlikely]] {
            status_ = status;
            if (const int node = segment.nodes[static_cast<std::size_t>(task - begin)]; node >= 0)
                failed_node_ = node;
            return false;
        }
    return true;
}

bool Simulation::commit(const CommitSegment& segment) noexcept {
    for (const auto& commit : segment.commits) {
        if (commit.is_double) {
            const auto* from = reinterpret_cast<const double*>(commit.from);
            const std::size_t count = commit.bytes / sizeof(double);
            bool is_nan = false;
            for (std::size_t i = 0; i < count; ++i) is_nan |= from[i] != from[i];
            if (is_nan) [[unlikely]] {
                while (*from == *from) ++from;
                status_ = Status::failure("a state became NaN: look at the block's inputs in this step for a "
                                          "division by zero or a value out of range");
                failed_node_ = owner(Role::discrete_state, from);
                return false;
            }
        }
        std::memcpy(commit.to, commit.from, commit.bytes);
    }
    return true;
}

int Simulation::owner(Role role, const double* element) noexcept {
    for (std::size_t n = 0; n < diagram_.nodes.size(); ++n) {
        const auto& slots = diagram_.nodes[n].block->declaration().slots;
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
        const auto& slots = diagram_.nodes[n].block->declaration().slots;
        for (std::size_t i = 0; i < slots.size(); ++i)
            if (slots[i].role == Role::output && diagram_.nodes[n].type != "Inport")
                std::memset(context_.data(static_cast<int>(n), static_cast<int>(i)), 0,
                            static_cast<std::size_t>(slots[i].size.count() * bytes(slots[i].type)));
    }
}

Status Simulation::reset_nodes(const std::vector<int>& nodes) noexcept {
    for (const int node : nodes)
        if (const Status status = context_.reset(node); !status) {
            failed_node_ = node;
            return status;
        }
    return ok;
}

void Simulation::clear_rates(int node) noexcept {
    const auto& slots = diagram_.nodes[static_cast<std::size_t>(node)].block->declaration().slots;
    for (std::size_t i = 0; i < slots.size(); ++i)
        if (slots[i].role == Role::continuous_state)
            std::memset(context_.frame(node).rate[i], 0,
                        static_cast<std::size_t>(slots[i].size.count()) * sizeof(double));
}

void Simulation::run_constants() {
    for (const auto& segment : constants_)
        if (!run(segment)) throw RunError(failure());
}

void Simulation::start() {
    stop();
    steps_ = 0;
    status_ = ok;
    failed_node_ = -1;
    for (std::size_t r = 0; r < diagram_.rates.size(); ++r) {
        until_hit_[r] = diagram_.rates[r].offset;
        const bool is_continuous = diagram_.rates[r].is_continuous;
        context_.clock(static_cast<int>(r)) = {0, is_continuous ? 0 : diagram_.period(static_cast<int>(r)),
                                               -1};
    }
    reset_conditions();
    std::fill(hit_.begin(), hit_.end(), std::uint8_t{0});
    std::fill(guard_before_.begin(), guard_before_.end(), std::numeric_limits<double>::quiet_NaN());
    std::fill(edges_.begin(), edges_.end(), 0.0);
    for (auto& guard : guard_bindings_) guard.recent = {};
    if (solver_) solver_->set_history(0, {});
    must_restart_ = true;
    is_at_event_ = false;
    clear_outputs();
    std::fill(context_.continuous_rate().begin(), context_.continuous_rate().end(), 0.0);
    const int nodes = static_cast<int>(diagram_.nodes.size());
    for (int n = 0; n < nodes; ++n)
        if (const Status status = context_.reset(n); !status) {
            status_ = status;
            failed_node_ = n;
            throw RunError(failure());
        }
    try {
        for (; started_ < nodes; ++started_) {
            try {
                context_.start(started_);
            } catch (const std::exception& error) {
                throw RunError(diagram_.nodes[static_cast<std::size_t>(started_)].path + ": " + error.what());
            }
        }
        run_constants();
    } catch (...) {
        stop();
        throw;
    }
    for (const auto& condition : diagram_.conditions)
        for (const auto& outlet : condition.outlets) diagram_.write_initial(outlet, context_);
}

void Simulation::observe() noexcept {
    for (Observer* observer : observers_) observer->observe(*this);
    for (auto& seen : seen_) std::memcpy(seen.last.data(), seen.now, seen.last.size());
}

void Simulation::show_what_was_seen() noexcept {
    for (const auto& seen : seen_) std::memcpy(seen.now, seen.last.data(), seen.last.size());
}

Status Simulation::step() noexcept {
    if (!status_) return status_;
    const double t = time();
    for (std::size_t r = 1; r < hit_.size(); ++r) {
        if (diagram_.rates[r].trigger > 0) continue;
        hit_[r] = until_hit_[r]-- == 0;
        if (!hit_[r]) continue;
        until_hit_[r] = diagram_.rates[r].ticks - 1;
        Clock& clock = context_.clock(static_cast<int>(r));
        clock.time = t;
        ++clock.step;
    }
    for (const auto& segment : outputs_)
        if (is_due(segment.rate, segment.condition) && !run(segment)) return status_;
    if (!guard_bindings_.empty() && !find_crossings()) return status_;
    observe();
    if (!are_outputs_finite() || !update_blocks(false)) return status_;
    if (solver_) {
        const bool is_good = integrate(t);
        show_what_was_seen();
        if (!is_good) return status_;
    }
    ++steps_;
    return ok;
}

bool Simulation::are_outputs_finite() noexcept {
    for (const auto& watched : watched_) {
        if (!is_due(watched.rate, watched.condition)) continue;
        for (int i = 0; i < watched.count; ++i)
            if (!std::isfinite(read_value(watched.data, watched.type, i)))
                return fail(Status::failure("its output {} is not finite: look at the block's inputs in this "
                                            "step for a division by zero or a value out of range",
                                            watched.number),
                            watched.node);
    }
    return true;
}

/// x⁻ := x⁺; afterwards no trigger holds any more.
bool Simulation::update_blocks(bool is_event) noexcept {
    const auto is_wanted = [&](const auto& segment) {
        return is_due(segment.rate, segment.condition) &&
               (!is_event || diagram_.rates[static_cast<std::size_t>(segment.rate)].trigger > 0);
    };
    for (const auto& segment : updates_)
        if (is_wanted(segment) && !run(segment)) return false;
    for (const auto& segment : commits_)
        if (is_wanted(segment) && !commit(segment)) return false;
    for (std::size_t r = 1; r < hit_.size(); ++r)
        if (diagram_.rates[r].trigger > 0) clear_trigger(r);
    return true;
}

void Simulation::stop() noexcept {
    for (; started_ > 0; --started_) context_.stop(started_ - 1);
}

std::string Simulation::failure() const {
    if (status_) return {};
    const std::string path = failed_node_ >= 0
                                 ? diagram_.nodes[static_cast<std::size_t>(failed_node_)].path + ": "
                                 : std::string();
    return path + status_.text();
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

std::vector<std::byte> Simulation::snapshot() const {
    if (const int node = context_.refuses_snapshot(); node >= 0)
        throw RunError(diagram_.nodes[static_cast<std::size_t>(node)].path +
                       ": its state lives outside and cannot be saved");
    std::vector<std::byte> bytes(context_.snapshot_size());
    context_.save(bytes.data());
    const auto put = [&](const void* from, std::size_t size) {
        const auto* begin = static_cast<const std::byte*>(from);
        bytes.insert(bytes.end(), begin, begin + size);
    };
    put(&steps_, sizeof(steps_));
    put(until_hit_.data(), until_hit_.size() * sizeof(std::int64_t));
    const auto conditions = save_conditions();
    put(conditions.data(), conditions.size() * sizeof(double));
    put(guard_before_.data(), guard_before_.size() * sizeof(double));
    put(edges_.data(), edges_.size() * sizeof(double));
    for (const auto& guard : guard_bindings_) put(&guard.recent, sizeof(guard.recent));
    for (const auto& held : held_) put(held.last.data(), held.last.size());
    if (solver_) {
        const std::vector<double> history = solver_->history();
        if (history.empty()) solver_->restart(time()); // both go on from here alike
        const double header[] = {static_cast<double>(history.size()), must_restart_ ? 1.0 : 0.0};
        put(header, sizeof(header));
        put(history.data(), history.size() * sizeof(double));
    }
    return bytes;
}

void Simulation::restore(const std::vector<std::byte>& snapshot) {
    std::size_t fixed = context_.snapshot_size() + sizeof(steps_) + until_hit_.size() * sizeof(std::int64_t) +
                        save_conditions().size() * sizeof(double) +
                        2 * guard_before_.size() * sizeof(double) +
                        guard_bindings_.size() * sizeof(GuardBinding::Recent);
    for (const auto& held : held_) fixed += held.last.size();
    const std::byte* from = snapshot.data();
    double header[2] = {}; // size of the solver's history, must it restart
    if (solver_) fixed += sizeof(header);
    if (solver_ && snapshot.size() >= fixed)
        std::memcpy(header, from + fixed - sizeof(header), sizeof(header));
    std::vector<double> history(static_cast<std::size_t>(
        std::clamp(header[0], 0.0, static_cast<double>(snapshot.size() / sizeof(double)))));
    if (snapshot.size() != fixed + history.size() * sizeof(double))
        throw RunError(
            "the snapshot has " + std::to_string(snapshot.size()) + " bytes, but this diagram's have " +
            std::to_string(fixed + history.size() * sizeof(double)) + "; it belongs to another model");
    context_.restore(from);
    from += context_.snapshot_size();
    const auto get = [&](void* to, std::size_t size) {
        if (size > 0) std::memcpy(to, from, size); // memory of no bytes may have no address
        from += size;
    };
    get(&steps_, sizeof(steps_));
    get(until_hit_.data(), until_hit_.size() * sizeof(std::int64_t));
    std::vector<double> conditions = save_conditions();
    get(conditions.data(), conditions.size() * sizeof(double));
    restore_conditions(conditions);
    get(guard_before_.data(), guard_before_.size() * sizeof(double));
    get(edges_.data(), edges_.size() * sizeof(double));
    for (auto& guard : guard_bindings_) get(&guard.recent, sizeof(guard.recent));
    for (auto& held : held_) get(held.last.data(), held.last.size());
    if (solver_) {
        from += sizeof(header);
        get(history.data(), history.size() * sizeof(double));
        solver_->set_history(time(), history);
        must_restart_ = header[1] != 0;
    }
    std::fill(hit_.begin(), hit_.end(), std::uint8_t{0});
    const auto rates = context_.continuous_rate();
    std::fill(rates.begin(), rates.end(), 0.0); // where nothing runs, states rest
    is_at_event_ = false;
    status_ = ok;
    failed_node_ = -1;
}

} // namespace bf
