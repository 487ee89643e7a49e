#include "timeline.hpp"

#include "bf/base/numbers.hpp"
#include "values.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace bf::service {

namespace {

NamedValues named(const std::vector<ParameterValue>& values) {
    NamedValues all;
    for (const auto& [path, elements] : values) all.emplace_back(path, elements);
    return all;
}

std::string text_of(const std::vector<double>& values) {
    std::string text;
    for (const double x : values) text += (text.empty() ? "" : " ") + number_text(x);
    return values.size() == 1 ? text : "[" + text + "]";
}

/// "Gain.Kp = 0.2, umax = 12 … 6": what was set, and to what in the end where that went on.
std::string text_of(const std::vector<Timeline::Change>& changes) {
    std::vector<std::pair<std::string, std::vector<std::string>>> all; // values by name
    for (const auto& change : changes)
        for (const auto& [name, values] : change.asked) {
            auto found = std::ranges::find(all, name, &decltype(all)::value_type::first);
            if (found == all.end()) found = all.insert(all.end(), {name, {}});
            found->second.push_back(text_of(values));
        }
    std::string text;
    for (const auto& [name, values] : all) {
        text += (text.empty() ? "" : ", ") + name + " = " + values.front();
        if (values.size() > 1) text += " … " + values.back();
    }
    return text;
}

Origin origin(const Moves& moves, std::int64_t before) {
    return [&moves, before](const std::string& path) { return moves.path_at(before, path); };
}

} // namespace

Timeline::~Timeline() {
    for (const auto& branch : branches_) branch->played->run.stop();
}

const Timeline::Branch* Timeline::branch(int index) const {
    const auto found = std::ranges::find(branches_, index, [](const auto& b) { return b->info.index; });
    return found == branches_.end() ? nullptr : found->get();
}

std::shared_ptr<Played> Timeline::started(std::shared_ptr<const LoadedModel> model, std::int64_t revision) {
    auto played = std::make_shared<Played>(std::move(model), revision);
    begin_(*played);
    played->run.start();
    return played;
}

Timeline::Branch& Timeline::add(int parent, double from, std::string cause, std::shared_ptr<Played> played) {
    branches_.push_back(std::make_unique<Branch>(
        Branch{{next_index_++, parent, from, from, std::move(cause)}, std::move(played)}));
    current_ = branches_.back()->info.index;
    cursor_ = {current_, 0, {}};
    return *branches_.back();
}

void Timeline::begin(std::shared_ptr<const LoadedModel> model, std::int64_t revision) {
    auto played = started(std::move(model), revision);
    const int before = cursor_.branch;
    const bool comes_instead = !branches_.empty() && at().info.reached == 0 && !is_left_by(before);
    add(-1, 0, "", std::move(played));
    checkpoint();
    if (comes_instead) std::erase_if(branches_, [&](const auto& b) { return b->info.index == before; });
    while (branches_.size() > most_branches_ && forget_oldest()) {
    }
}

// ---- on and back

const Timeline::Checkpoint& Timeline::Branch::checkpoint_until(double time) const {
    const auto after = std::ranges::upper_bound(checkpoints, time, {}, &Checkpoint::time);
    return *(after == checkpoints.begin() ? after : std::prev(after));
}

/// Of the current branch and those that it comes from, the one that has that time.
const Timeline::Branch& Timeline::owner(double time) const {
    const Branch* found = &current();
    while (found->info.parent >= 0 && time < found->info.from - found->played->run.period() / 2)
        found = branch(found->info.parent);
    return *found;
}

/// Where the current branch leaves the one at work, it goes on.
void Timeline::settle() {
    const Branch& next = owner(time());
    if (next.info.index != cursor_.branch) restore(next, next.checkpoints.front());
}

void Timeline::restore(const Branch& branch, const Checkpoint& checkpoint) {
    branch.played->run.restore(checkpoint.data);
    cursor_ = {branch.info.index, checkpoint.changes, {}};
}

bool Timeline::apply_changes(Cursor& cursor) {
    const Branch& of = *branch(cursor.branch);
    Simulation& run = of.played->run;
    for (; cursor.changes < of.changes.size() && of.changes[cursor.changes].step <= run.steps();
         ++cursor.changes) {
        ParameterChange change = run.prepare(of.changes[cursor.changes].values);
        if (!run.apply(change)) return false;
    }
    return true;
}

bool Timeline::step(Cursor& cursor) {
    return apply_changes(cursor) && branch(cursor.branch)->played->run.step();
}

void Timeline::peek() {
    const Cursor here = leave();
    Cursor ahead = cursor_;
    static_cast<void>(step(ahead)); // one that fails shows what came before, and fails again when it is made
    enter(here);
}

bool Timeline::advance() {
    if (!step(cursor_)) return false;
    Branch& here = this->here();
    if (const double now = time(); now > here.info.reached) {
        here.info.reached = now;
        if (now >= here.checkpoints.back().time + here.interval) checkpoint();
    }
    settle();
    return true;
}

bool Timeline::go_to(double time, bool anew) {
    const Branch& of = owner(time);
    const double half = of.played->run.period() / 2;
    const Checkpoint& last = of.checkpoint_until(time + half);
    const bool is_on_the_way =
        !anew && cursor_.branch == of.info.index && this->time() <= time + half && this->time() >= last.time;
    if (!is_on_the_way) restore(of, last);
    while (this->time() + half < time)
        if (!advance()) return false;
    return true;
}

void Timeline::choose(int index) {
    if (!branch(index)) throw RunError("there is no branch " + std::to_string(index) + "; it was forgotten");
    const double now = time();
    current_ = index;
    go_to(std::min(now, reached()), true);
}

Timeline::Cursor Timeline::leave() const {
    Cursor here = cursor_;
    here.data = at().played->run.snapshot();
    return here;
}

void Timeline::enter(const Cursor& cursor) { branch(cursor.branch)->played->run.restore(cursor.data); }

Timeline::Cursor Timeline::before(int index, double time) const {
    const Checkpoint& last = branch(index)->checkpoint_until(time);
    return {index, last.changes, last.data};
}

// ---- what makes branches

std::vector<const Timeline::Change*> Timeline::changes_so_far() const {
    std::vector<const Change*> all;
    const double now = time();
    const auto add = [&](const auto& self, const Branch& of) -> void {
        const Branch* const parent = branch(of.info.parent);
        if (parent && parent->played == of.played) self(self, *parent);
        for (const auto& change : of.changes)
            if (static_cast<double>(change.step) * run_period() <= now + run_period() / 2)
                all.push_back(&change);
    };
    add(add, at());
    return all;
}

std::vector<ParameterValue> Timeline::asked_so_far() const {
    std::vector<ParameterValue> all;
    for (const Change* change : changes_so_far())
        all.insert(all.end(), change->asked.begin(), change->asked.end());
    return all;
}

std::vector<ParameterValue> Timeline::unlike(const Diagram& given) const {
    const Diagram& here = at().played->model->diagram;
    Tuning tuning(here);
    Values parameters;
    for (const Change* change : changes_so_far()) {
        tuning.accept(named(change->asked));
        for (const auto& [path, values] : change->values) parameters[path] = values;
    }
    Values of_given;
    if (&here == &given) { // what was not set is the same
        for (const auto& [path, values] : parameters)
            of_given[path] = given.slot(given.find_parameter(path)).initial;
    } else {
        of_given = values_of_parameters(given);
        parameters.merge(values_of_parameters(here));
    }
    std::vector<ParameterValue> all;
    const auto add = [&](const Values& now, const Values& before) {
        for (const auto& [path, values] : now)
            if (const auto known = before.find(path); known != before.end() && known->second != values)
                all.push_back({path, values});
    };
    add(values_of_variables(tuning), values_of_variables(Tuning(given)));
    add(parameters, of_given);
    return all;
}

void Timeline::change(const std::vector<ParameterValue>& asked) {
    Simulation& run = this->run();
    if (!apply_changes(cursor_)) throw RunError(run.failure());
    Tuning tuning(run.diagram());
    for (const auto& before : asked_so_far()) tuning.accept(named({before}));
    std::vector<ParameterValue> values;
    for (auto& [name, elements] : tuning.follow(named(asked))) values.push_back({name, std::move(elements)});
    ParameterChange change = run.prepare(values);
    const double now = time();
    const bool is_in_the_past = at().info.reached > now + run_period() / 2;
    if (is_in_the_past) make_room();
    if (const Status status = run.apply(change); !status) throw RunError(change.why_refused(status));
    if (is_in_the_past) add(cursor_.branch, now, "", at().played);
    Branch& here = this->here();
    // The same name at the same time again: its value is still being chosen.
    std::erase_if(here.changes, [&](const Change& before) {
        return before.step == run.steps() && before.asked.size() == 1 && asked.size() == 1 &&
               before.asked.front().path == asked.front().path;
    });
    here.changes.push_back({run.steps(), asked, std::move(values)});
    cursor_.changes = here.changes.size();
    if (here.info.parent >= 0 && branch(here.info.parent)->played == here.played)
        here.info.cause = text_of(here.changes);
    checkpoint();
}

bool Timeline::is_left_by(int index) const {
    return std::ranges::any_of(branches_, [&](const auto& b) { return b->info.parent == index; });
}

bool Timeline::is_fresh_edit() const {
    const Branch& here = at();
    const Branch* const parent = branch(here.info.parent);
    return parent && parent->played != here.played && here.info.reached == here.info.from &&
           current_ == cursor_.branch && !is_left_by(cursor_.branch);
}

RunEdit Timeline::compare(const Edited& edited) const {
    RunEdit edit;
    const Played& before = *(is_fresh_edit() ? branch(at().info.parent) : &at())->played;
    const Diagram& diagram = edited.model->diagram;
    const double period = diagram.step, now = time();
    if (std::abs(std::round(now / period) * period - now) > 1e-9 * std::max(1.0, now)) {
        edit.refusal = "the time lies within a step of the edited model; go on from a multiple of " +
                       number_text(period) + " s, or start anew";
        return edit;
    }
    try {
        Simulation other(diagram);
        Handover found = handover(before.run, other, origin(edited.moves, before.revision));
        edit.lost = std::move(found.lost);
        edit.begun = std::move(found.begun);
        if (edited.moves.is_by_hand_since(before.revision))
            edit.unclear = unclear(before.model->diagram, diagram);
    } catch (const std::exception& error) {
        edit.refusal = error.what();
    }
    return edit;
}

void Timeline::edit(const Edited& edited) {
    auto next = started(edited.model, edited.revision);
    const double now = time();
    const std::vector<ParameterValue> asked = asked_so_far();
    const auto before = at().played;
    const int last = cursor_.branch;
    // Nothing was simulated since the last edit: this one comes in its place, and what that one took away is
    // there again.
    const bool comes_instead = is_fresh_edit();
    if (comes_instead) {
        current_ = at().info.parent;
        go_to(now);
    } else {
        make_room();
    }
    try {
        next->run.go_on_from(run(), origin(edited.moves, at().played->revision));
    } catch (const RunError&) {
        current_ = last;
        go_to(now);
        throw;
    }
    add(cursor_.branch, now, edited.cause, next);
    if (comes_instead) std::erase_if(branches_, [&](const auto& b) { return b->info.index == last; });
    const auto path_since = [&](const std::string& path) {
        return edited.moves.path_since(before->revision, path);
    };
    for (const auto& value : still_asked(before->model->diagram, next->model->diagram, asked, path_since))
        try {
            Tuning tuning(next->model->diagram);
            for (const auto& known : at().changes) tuning.accept(named(known.asked));
            Change again{next->run.steps(), {value}, {}};
            for (auto& [name, elements] : tuning.follow(named({value})))
                again.values.push_back({name, std::move(elements)});
            ParameterChange change = next->run.prepare(again.values);
            if (next->run.apply(change)) here().changes.push_back(std::move(again));
        } catch (const std::exception&) { // the edited model does not take it any more
        }
    cursor_.changes = at().changes.size();
    checkpoint();
}

// ---- memory

/// Of those that neither the current branch nor another one comes from.
bool Timeline::forget_oldest() {
    const auto is_needed = [&](const Branch& one) {
        for (const Branch* on = &current(); on; on = branch(on->info.parent))
            if (on == &one) return true;
        return is_left_by(one.info.index);
    };
    const auto oldest = std::ranges::find_if(branches_, [&](const auto& b) { return !is_needed(*b); });
    if (oldest == branches_.end()) return false;
    branches_.erase(oldest);
    return true;
}

void Timeline::make_room() {
    if (branches_.size() >= most_branches_ && !forget_oldest())
        throw RunError(
            "the run has " + std::to_string(branches_.size()) +
            " branches, each of which comes from another one; choose an earlier one, or start anew");
}

void Timeline::checkpoint() {
    Branch& here = this->here();
    if (!here.checkpoints.empty() && here.checkpoints.back().time >= time()) here.checkpoints.pop_back();
    here.checkpoints.push_back({time(), cursor_.changes, here.played->run.snapshot()});
    const auto size = [](const auto& branch) {
        return branch->checkpoints.size() * branch->checkpoints.front().data.size();
    };
    for (;;) {
        std::size_t all = 0;
        for (const auto& branch : branches_) all += size(branch);
        Branch& largest = **std::ranges::max_element(branches_, {}, size);
        if (all < most_bytes_ || largest.checkpoints.size() < 2) return;
        // Half of them, twice as far apart; the first one is that of the beginning.
        std::vector<Checkpoint> kept;
        for (std::size_t i = 0; i < largest.checkpoints.size(); i += 2)
            kept.push_back(std::move(largest.checkpoints[i]));
        largest.checkpoints = std::move(kept);
        largest.interval *= 2;
    }
}

} // namespace bf::service
