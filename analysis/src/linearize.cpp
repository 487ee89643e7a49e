#include "bf/analysis/linearize.hpp"

#include "bf/analysis/response.hpp"
#include "bf/program/program.hpp"
#include "channel.hpp"
#include "differential.hpp"
#include "look.hpp"
#include "named.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <unsupported/Eigen/MatrixFunctions>

namespace bf::analysis {

namespace {

class Linearization {
  public:
    Linearization(Simulation& run, const LinearizeOptions& options)
        : run_(run), d_(run.diagram()), context_(run.context()), options_(options) {
        const ChannelFinder finder(d_);
        from_ = finder.find(options.from);
        to_ = finder.find(options.to);
        open_ = finder.find(options.open);
        if (!options.at_once) {
            if (from_.empty()) from_ = finder.of_root(d_.inputs, "input", "--from");
            if (to_.empty()) to_ = finder.of_root(d_.outputs, "output", "--to");
        }
        for (const auto* channels : {&from_, &open_})
            for (const auto& channel : *channels)
                if (is_state(slot(channel.end).role))
                    throw RunError("'" + channel.name +
                                   "' is a state, to which nothing is added and which nobody reads as a "
                                   "signal; name an output of its block, or what it follows from");
        leaves_states_out_ = !keeps_all();
        if (leaves_states_out_) find_between();
        for (int n = 0; n < static_cast<int>(d_.nodes.size()); ++n)
            for (int s = 0; is_between(n) && s < static_cast<int>(slots(n).size()); ++s)
                if (is_state(slot({n, s}).role) && is_real({n, s})) every_state_.push_back(whole(d_, {n, s}));
        for (int n = 0; n < static_cast<int>(d_.nodes.size()); ++n)
            runs_.push_back(rate(n).trigger == 0 && is_between(n));
        behind_outputs_ = behind_outputs();
        input_names_ = names(from_);
        output_names_ = names(to_);
    }

    /// Is a signal that is input, output and cut held by that alone? Known with the system.
    bool holds_a_loop() const { return holds_a_loop_; }
    LinearSystem operator()() {
        begin();
        // By inputs first: until one is seen to move some of them, states need no seeds.
        pass(by_inputs_, false);
        if (leaves_states_out_) add_driven(advanced(*by_inputs_, every_state_));
        pass(by_states_, true);
        const int all = size(states_);
        Matrix y(size(to_), all + size(from_)), next(all, all + size(from_));
        y.leftCols(all) = outputs(*by_states_);
        y.rightCols(size(from_)) = outputs(*by_inputs_);
        next.leftCols(all) = advanced(*by_states_, states_);
        next.rightCols(size(from_)) = advanced(*by_inputs_, states_);
        find_paths(next, y);
        if (!options_.at_once) find_rates();
        if (needs_map())
            map_period();
        else {
            system_.A = next(kept_, kept_);
            system_.B = next(kept_, inputs(all));
            system_.C = y(Eigen::all, kept_);
            system_.D = y(Eigen::all, inputs(all));
            system_.period = sampled_.empty() ? 0 : d_.period(*sampled_.begin());
        }
        describe();
        return std::move(system_);
    }

  private:
    const Slot& slot(const Node::End& end) const { return d_.slot(end); }
    const std::vector<Slot>& slots(int n) const {
        return d_.nodes[static_cast<std::size_t>(n)].block->resolution().slots;
    }
    const SampleRate& rate(int node) const {
        return d_.rates[static_cast<std::size_t>(d_.nodes[static_cast<std::size_t>(node)].rate)];
    }
    bool is_real(const Node::End& end) const { return analysis::is_real(slot(end).type); }
    const std::string& path(int node) const { return d_.nodes[static_cast<std::size_t>(node)].path; }
    bool keeps_all() const { return options_.all_states || options_.at_once; }
    static int size(const std::vector<Channel>& channels) {
        int count = 0;
        for (const auto& channel : channels) count += static_cast<int>(channel.elements.size());
        return count;
    }
    std::vector<int> inputs(int first) const {
        std::vector<int> all(static_cast<std::size_t>(size(from_)));
        std::iota(all.begin(), all.end(), first);
        return all;
    }

    // ---- seeds and results

    /// All that belongs to a point.
    void begin() {
        system_ = {};
        system_.time = run_.time();
        states_.clear();
        if (!leaves_states_out_) states_ = every_state_;
        flows_.clear();
        for (auto* nodes : {&differenced_, &kinks_, &sampled_}) nodes->clear();
        on_path_.clear();
        kept_.clear();
        has_continuous_ = has_memory_ = holds_a_loop_ = false;
    }

    /// By the states that count, or by the inputs. What was made at another point keeps its memory.
    void pass(std::unique_ptr<Differential>& made, bool by_states) {
        const int seeds = size(by_states ? states_ : from_);
        if (made && made->seeds() == seeds) {
            made->begin();
        } else {
            made = std::make_unique<Differential>(run_, seeds, options_.by_differences);
            if (seeds > 0) add_inputs(*made, by_states ? -1 : 0);
        }
        if (by_states && states_.empty()) return;
        if (by_states) seed_states(*made);
        const auto every = [this](int node) { return runs_[static_cast<std::size_t>(node)] != 0; };
        made->outputs(every);
        made->updates(every);
        made->derivatives(every);
        flows_.insert(flows_.end(), made->flows().begin(), made->flows().end());
        differenced_.insert(made->differenced().begin(), made->differenced().end());
        kinks_.insert(made->kinks().begin(), made->kinks().end());
    }

    /// States that inputs move, and those to which wires lead from them: no others are on a path.
    void add_driven(const Matrix& next) {
        NodeSet driven;
        int row = 0;
        for (const auto& state : every_state_) {
            const auto count = static_cast<int>(state.elements.size());
            if ((next.middleRows(row, count).array() != 0).any()) driven.insert(state.end.node);
            row += count;
        }
        driven = reached(std::move(driven), [&](int node, auto&& go) {
            for (const auto& [slot, reader] : readers_[static_cast<std::size_t>(node)]) go(reader);
        });
        for (const auto& state : every_state_)
            if (driven.contains(state.end.node)) states_.push_back(state);
    }

    /// A column for each element of the states.
    void seed_states(Differential& differential) {
        int column = 0;
        for (const auto& state : states_) {
            Matrix rows = Matrix::Zero(slot(state.end).size.count(), differential.seeds());
            for (const int i : state.elements) rows(i, column++) = 1;
            differential.set(state.end, rows);
        }
    }

    /// Each input adds its column to the signal, from `first` on, or not where that is -1; a signal that is
    /// cut forgets what it was computed from.
    void add_inputs(Differential& differential, int first) {
        std::map<std::pair<int, int>, std::vector<std::pair<int, int>>> added; // element, column
        int column = first;
        for (const auto& channel : from_)
            for (const int i : channel.elements)
                if (first >= 0) added[{channel.end.node, channel.end.slot}].emplace_back(i, column++);
        std::map<std::pair<int, int>, std::vector<int>> cut;
        for (const auto& channel : open_) {
            auto& elements = cut[{channel.end.node, channel.end.slot}];
            elements.insert(elements.end(), channel.elements.begin(), channel.elements.end());
            added[{channel.end.node, channel.end.slot}];
        }
        for (const auto& [end, columns] : added)
            differential.at({end.first, end.second}, [columns = columns, cut = cut[end]](Matrix& rows) {
                for (const int i : cut) rows.row(i).setZero();
                for (const auto& [i, c] : columns) rows(i, c) += 1;
            });
    }

    bool is_cut(const Node::End& end, int element) const {
        return std::any_of(open_.begin(), open_.end(), [&](const Channel& channel) {
            return channel.end.node == end.node && channel.end.slot == end.slot &&
                   std::count(channel.elements.begin(), channel.elements.end(), element) > 0;
        });
    }

    bool is_cut(const Node::End& end) const {
        if (open_.empty()) return false;
        for (int e = 0; e < slot(end).size.count(); ++e)
            if (!is_cut(end, e)) return false;
        return true;
    }

    Matrix outputs(Differential& differential) const {
        Matrix y(size(to_), differential.seeds());
        int row = 0;
        for (const auto& channel : to_) {
            const Matrix computed = differential.computed(channel.end), read = differential.rows(channel.end);
            for (const int i : channel.elements)
                y.row(row++) = (is_cut(channel.end, i) ? computed : read).row(i);
        }
        return y;
    }

    /// Of each state, x' or x⁺.
    Matrix advanced(const Differential& differential, const std::vector<Channel>& states) const {
        Matrix next(size(states), differential.seeds());
        int row = 0;
        for (const auto& state : states) {
            const auto count = static_cast<int>(state.elements.size());
            next.middleRows(row, count) = slot(state.end).role == Role::discrete_state
                                              ? differential.next(state.end)
                                              : differential.rate(state.end);
            row += count;
        }
        return next;
    }

    // ---- what lies on a path from an input to an output

    /// Those nodes that wires lead to from an input, and from to an output: others are of no account,
    /// whatever their derivatives.
    void find_between() {
        readers_.resize(d_.nodes.size());
        std::set<int> begin, end;
        for (int n = 0; n < static_cast<int>(d_.nodes.size()); ++n)
            for (const auto& source : d_.nodes[static_cast<std::size_t>(n)].sources) {
                if (source.node < 0) continue;
                readers_[static_cast<std::size_t>(source.node)].emplace_back(source.slot, n);
                for (const auto& channel : from_)
                    if (channel.end.node == source.node && channel.end.slot == source.slot) begin.insert(n);
            }
        for (const auto& channel : to_) end.insert(channel.end.node);
        const auto driven = reached(std::move(begin), [&](int node, auto&& go) {
            for (const auto& [slot, reader] : readers_[static_cast<std::size_t>(node)])
                if (!is_cut({node, slot})) go(reader);
        });
        const auto seen = reached(std::move(end), [&](int node, auto&& go) {
            for (const auto& source : d_.nodes[static_cast<std::size_t>(node)].sources)
                if (source.node >= 0 && !is_cut(source)) go(source.node);
        });
        between_.emplace();
        std::set_intersection(driven.begin(), driven.end(), seen.begin(), seen.end(),
                              std::inserter(*between_, between_->end()));
    }
    bool is_between(int node) const { return !between_ || between_->contains(node); }

    void find_paths(const Matrix& next, const Matrix& y) {
        const int all = size(states_);
        std::vector<int> nodes;
        for (const auto& state : states_) nodes.insert(nodes.end(), state.elements.size(), state.end.node);
        const auto closure = [&](std::vector<char> reached, bool is_forward) {
            std::vector<int> pending;
            for (int i = 0; i < all; ++i)
                if (reached[static_cast<std::size_t>(i)]) pending.push_back(i);
            while (!pending.empty()) {
                const int i = pending.back();
                pending.pop_back();
                for (int j = 0; j < all; ++j) {
                    if (reached[static_cast<std::size_t>(j)] || (is_forward ? next(j, i) : next(i, j)) == 0)
                        continue;
                    reached[static_cast<std::size_t>(j)] = 1;
                    pending.push_back(j);
                }
            }
            return reached;
        };
        std::vector<char> driven(static_cast<std::size_t>(all)), seen(static_cast<std::size_t>(all));
        for (int i = 0; i < all; ++i) {
            driven[static_cast<std::size_t>(i)] = (next.row(i).tail(size(from_)).array() != 0).any();
            seen[static_cast<std::size_t>(i)] = (y.col(i).array() != 0).any();
        }
        driven = closure(driven, true);
        seen = closure(seen, false);
        NodeSet ends, driven_nodes, seen_nodes;
        for (int i = 0; i < all; ++i) {
            const auto n = static_cast<std::size_t>(i);
            if (driven[n]) driven_nodes.insert(nodes[n]);
            if (seen[n]) seen_nodes.insert(nodes[n]);
            if (driven[n] && seen[n]) on_path_.insert(nodes[n]);
            if (seen[n]) ends.insert(nodes[n]);
            if ((driven[n] && seen[n]) || keeps_all()) kept_.push_back(i);
        }
        // In a ring of samples, what is written in this step is seen in a later one.
        for (const int node : driven_nodes)
            if (!options_.at_once) check_counters(node, seen_nodes.contains(node));
        if (keeps_all())
            for (const int i : kept_) ends.insert(nodes[static_cast<std::size_t>(i)]);
        // Blocks without states are on a path where they change with the inputs and somebody on it reads
        // them.
        for (const auto& channel : to_) ends.insert(channel.end.node);
        sources_.resize(d_.nodes.size());
        for (auto& its : sources_) its.clear();
        for (const auto& [source, slot, reader] : flows_)
            if (!is_cut({source, slot})) sources_[static_cast<std::size_t>(reader)].push_back(source);
        const auto read = reached(std::move(ends), [&](int node, auto&& go) {
            for (const int source : sources_[static_cast<std::size_t>(node)]) go(source);
        });
        for (const int node : read)
            if (changes_with_inputs(node, driven)) on_path_.insert(node);
    }

    bool changes_with_inputs(int node, const std::vector<char>& driven) const {
        for (int s = 0; s < static_cast<int>(slots(node).size()); ++s) {
            if (slot({node, s}).role != Role::output) continue;
            if (!by_inputs_->own({node, s}).is_zero()) return true;
            for (const int c : by_states_->own({node, s}).seeds())
                if (c < static_cast<int>(driven.size()) && driven[static_cast<std::size_t>(c)]) return true;
        }
        return false;
    }

    void find_rates() {
        for (const int node : on_path_) {
            const auto& r = rate(node);
            if (d_.nodes[static_cast<std::size_t>(node)].block->declaration().traits.is_root_input ||
                r.is_constant || r.trigger > 0)
                continue;
            if (!r.is_continuous) sampled_.insert(d_.nodes[static_cast<std::size_t>(node)].rate);
        }
        int i = 0;
        for (const auto& state : states_)
            for (std::size_t e = 0; e < state.elements.size(); ++e, ++i) {
                if (!std::count(kept_.begin(), kept_.end(), i)) continue;
                if (slot(state.end).role == Role::continuous_state)
                    has_continuous_ = true;
                else if (rate(state.end.node).is_continuous)
                    has_memory_ = true;
                else if (rate(state.end.node).trigger == 0 && !rate(state.end.node).is_constant)
                    sampled_.insert(d_.nodes[static_cast<std::size_t>(state.end.node)].rate);
            }
    }

    /// A state that is no real number and changes with each step makes another linear system of each step.
    /// Where nothing that the node holds is seen yet, samples may be on their way, and are counted; what is
    /// on or off there may change once, as in a first step.
    void check_counters(int node, bool is_seen) {
        if (rate(node).trigger > 0 || !(is_seen || (between_ && is_between(node)))) return;
        const Frame& frame = context_.frame(node);
        for (int s = 0; s < static_cast<int>(slots(node).size()); ++s)
            if (const Slot& its = slot({node, s}); its.role == Role::discrete_state)
                std::memcpy(frame.next[s], frame.now[s],
                            static_cast<std::size_t>(its.size.count() * bytes(its.type)));
        for (int i = 0; i < context_.activities(node, Phase::update); ++i)
            if (!context_.task(node, Phase::update, i)()) return;
        for (int s = 0; s < static_cast<int>(slots(node).size()); ++s) {
            const Slot& its = slot({node, s});
            if (its.role != Role::discrete_state || is_real({node, s})) continue;
            if (its.type == Type::boolean && !is_seen) continue;
            for (int e = 0; e < its.size.count(); ++e)
                if (read_value(frame.now[s], its.type, e) != read_value(frame.next[s], its.type, e))
                    throw RunError(
                        path(node) + ": its state '" + its.name +
                        "' changes in this step, and with it the linear system; choose another time (--at), "
                        "or a block that does without, as a Delay instead of a ring of samples");
        }
    }
    bool needs_map() const {
        return has_memory_ || sampled_.size() > 1 || (has_continuous_ && !sampled_.empty());
    }

    // ---- several rates

    std::string rates_text() const {
        std::string text;
        for (const int r : sampled_) text += (text.empty() ? "" : ", ") + program::period_text(d_, r);
        if (has_continuous_) text += ", continuous";
        return text;
    }

    void map_period() {
        std::int64_t steps = 1;
        constexpr std::int64_t most_steps = 1'000'000;
        for (const int r : sampled_) {
            const auto& its = d_.rates[static_cast<std::size_t>(r)];
            if (its.offset != 0)
                throw RunError(
                    "on the paths are the rates " + rates_text() +
                    "; one with an offset has no map over a period that begins with all of them; leave the "
                    "offset out, or open the path before it (--open)");
            steps = std::lcm(steps, its.ticks);
            if (steps > most_steps)
                throw RunError(
                    "on the paths are the rates " + rates_text() + ", whose common period is more than " +
                    std::to_string(most_steps) +
                    " base steps; choose periods that divide one another, or open the path (--open)");
        }
        for (const auto& channel : from_)
            if (!channel.elements.empty() && is_cut(channel.end, channel.elements.front()) &&
                is_held(channel.end.node, steps)) {
                holds_a_loop_ = true;
                system_.held.push_back(
                    channel.name + ": where it is cut it is held over the common period of " + rates_text() +
                    ", and the loop goes on within; its margins are of what is added as rarely, open the "
                    "path of the slowest rate (--open)");
            }
        const int count = static_cast<int>(kept_.size()), columns = count + size(from_);
        Differential map(run_, columns, options_.by_differences);
        const Matrix Ac = continuous_part();
        const auto n = Ac.rows();
        Matrix block = Matrix::Zero(2 * n, 2 * n);
        block.topLeftCorner(n, n) = Ac * d_.step;
        block.topRightCorner(n, n) = Matrix::Identity(n, n) * d_.step;
        const Matrix flow = block.exp(), phi = flow.topLeftCorner(n, n), gamma = flow.topRightCorner(n, n);

        Matrix x = Matrix::Zero(count, columns);
        x.leftCols(count).setIdentity();
        add_inputs(map, count);
        for (std::int64_t k = 0; k < steps; ++k) {
            put(map, x);
            const auto runs = [&](int node) {
                const auto& r = rate(node);
                return r.trigger == 0 && (r.is_continuous || k % r.ticks == 0) && is_between(node);
            };
            map.outputs(runs);
            if (k == 0) {
                const Matrix y = outputs(map);
                system_.C = y.leftCols(count);
                system_.D = y.rightCols(size(from_));
            }
            map.updates(runs);
            map.derivatives(runs);
            const Matrix next = advanced(map, states_);
            Matrix state(n, columns), slope(n, columns);
            int c = 0;
            for (int i = 0; i < count; ++i)
                if (is_continuous(i)) {
                    state.row(c) = x.row(i);
                    slope.row(c++) = next.row(kept_[static_cast<std::size_t>(i)]);
                }
            const Matrix moved = phi * state + gamma * (slope - Ac * state);
            c = 0;
            for (int i = 0; i < count; ++i) {
                const int row = kept_[static_cast<std::size_t>(i)];
                if (is_continuous(i))
                    x.row(i) = moved.row(c++);
                else if (runs(owner(row).node))
                    x.row(i) = next.row(row);
            }
        }
        system_.A = x.leftCols(count);
        system_.B = x.rightCols(size(from_));
        system_.period = static_cast<double>(steps) * d_.step;
    }

    /// Is a signal held over so many base steps alone because it is cut: does what comes back to it change
    /// within them, and does that matter before they are over?
    bool is_held(int cut, std::int64_t steps) const {
        const auto runs_once = [&](int node) {
            return !rate(node).is_continuous && rate(node).ticks == steps;
        };
        const auto acts = [&](int node) {
            return !rate(node).is_continuous || std::any_of(slots(node).begin(), slots(node).end(),
                                                            [](const Slot& s) { return is_state(s.role); });
        };
        const auto leads_within = [&](bool is_forward) {
            bool does = false;
            static_cast<void>(reached({cut}, [&](int node, auto&& go) {
                for (const auto& [source, slot, reader] : flows_) {
                    const int other = is_forward ? reader : source;
                    if (node != (is_forward ? source : reader) || !on_path_.contains(other) ||
                        runs_once(other))
                        continue;
                    if (acts(other))
                        does = true;
                    else
                        go(other);
                }
            }));
            return does;
        };
        return !runs_once(cut) && leads_within(true) && (acts(cut) || leads_within(false));
    }

    /// Which state element i of all is of.
    Node::End owner(int i) const {
        for (const auto& state : states_) {
            if (i < static_cast<int>(state.elements.size())) return state.end;
            i -= static_cast<int>(state.elements.size());
        }
        return {};
    }
    bool is_continuous(int kept) const {
        return slot(owner(kept_[static_cast<std::size_t>(kept)])).role == Role::continuous_state;
    }

    /// Rows of the kept states := those of x; others do not move.
    void put(Differential& differential, const Matrix& x) const {
        int i = 0, kept = 0;
        for (const auto& state : states_) {
            Matrix rows = differential.rows(state.end);
            for (const int e : state.elements) {
                if (kept < static_cast<int>(kept_.size()) && kept_[static_cast<std::size_t>(kept)] == i)
                    rows.row(e) = x.row(kept++);
                ++i;
            }
            differential.set(state.end, rows);
        }
    }

    /// x_c' by x_c alone, while all that is sampled is held.
    Matrix continuous_part() {
        std::vector<int> continuous;
        for (int i = 0; i < static_cast<int>(kept_.size()); ++i)
            if (is_continuous(i)) continuous.push_back(i);
        const auto n = static_cast<int>(continuous.size());
        Matrix Ac = Matrix::Zero(n, n);
        if (n == 0) return Ac;
        Differential part(run_, n + size(from_), options_.by_differences);
        Matrix x = Matrix::Zero(static_cast<Eigen::Index>(kept_.size()), n + size(from_));
        for (int c = 0; c < n; ++c) x(continuous[static_cast<std::size_t>(c)], c) = 1;
        put(part, x);
        add_inputs(part, n);
        const auto runs = [this](int node) { return rate(node).is_continuous && is_between(node); };
        part.outputs(runs);
        part.derivatives(runs);
        const Matrix next = advanced(part, states_);
        for (int c = 0; c < n; ++c)
            Ac.row(c) =
                next.row(kept_[static_cast<std::size_t>(continuous[static_cast<std::size_t>(c)])]).head(n);
        return Ac;
    }

    // ---- what else is said

    void describe() {
        const auto value = [this](const Node::End& end, int e) {
            return read_value(context_.data(end.node, end.slot), slot(end).type, e);
        };
        const auto say = [&](const std::vector<Channel>& channels, Vector& values,
                             std::vector<std::string>& units) {
            values.resize(size(channels));
            int i = 0;
            for (const auto& channel : channels)
                for (const int e : channel.elements) {
                    units.push_back(slot(channel.end).unit.text == any_unit.text
                                        ? std::string()
                                        : std::string(slot(channel.end).unit.text));
                    values[i++] = value(channel.end, e);
                }
        };
        say(from_, system_.u, system_.input_units);
        say(to_, system_.y, system_.output_units);
        system_.inputs = input_names_;
        system_.outputs = output_names_;
        system_.x.resize(static_cast<Eigen::Index>(kept_.size()));
        int i = 0, kept = 0;
        for (const auto& state : states_)
            for (const int e : state.elements)
                if (kept < static_cast<int>(kept_.size()) && kept_[static_cast<std::size_t>(kept)] == i++) {
                    system_.states.push_back(name(d_, state, e));
                    system_.x[kept++] = value(state.end, e);
                }
        for (const int node : differenced_)
            if (on_path_.contains(node)) system_.differenced.push_back(path(node));
        for (const int node : context_.outside())
            system_.held.push_back(path(node) + ": its state lives outside of the diagram");
        for (std::size_t c = 1; c < d_.conditions.size(); ++c)
            if (!by_inputs_->is_active(static_cast<int>(c)))
                system_.held.push_back(d_.conditions[c].path + (d_.conditions[c].trigger.node >= 0
                                                                    ? ": it runs when it is triggered"
                                                                    : ": it is disabled"));
        find_kinks();
    }

    std::vector<std::string> names(const std::vector<Channel>& channels) const {
        std::vector<std::string> all;
        for (const auto& channel : channels)
            for (const int e : channel.elements) all.push_back(name(d_, channel, e));
        return all;
    }

    /// Nodes that what is looked at depends on, by wires.
    std::set<int> behind_outputs() const {
        std::set<int> ends;
        for (const auto& channel : to_) ends.insert(channel.end.node);
        return reached(std::move(ends), [this](int node, auto&& go) {
            for (const auto& source : d_.nodes[static_cast<std::size_t>(node)].sources)
                if (source.node >= 0) go(source.node);
        });
    }

    /// Where blocks jump or have a corner, derivatives may be 0 and the path end there; zero-crossing
    /// functions tell of those that no derivative met.
    void find_kinks() {
        for (const int node : behind_outputs_)
            if (kinks_.contains(node) || (on_path_.contains(node) && is_at_zero_crossing(node)))
                system_.kinks.push_back(path(node));
    }
    bool is_at_zero_crossing(int node) {
        const Frame& frame = context_.frame(node);
        for (int i = 0; i < context_.activities(node, Phase::guards); ++i)
            if (!context_.task(node, Phase::guards, i)()) return false;
        for (int s = 0; s < static_cast<int>(slots(node).size()); ++s) {
            const Slot& its = slot({node, s});
            if (its.role != Role::guard || its.type != Type::float64) continue;
            for (int e = 0; e < its.size.count(); ++e)
                if (read_value(frame.now[s], its.type, e) == 0) return true;
        }
        return false;
    }

    Simulation& run_;
    const Diagram& d_;
    Context& context_;
    const LinearizeOptions options_;
    std::vector<Channel> from_, to_, open_;
    std::vector<Channel> every_state_, states_; ///< between, and of these the ones that count here
    std::vector<char> runs_;                    ///< by node: at its rate, and between
    bool leaves_states_out_ = false;
    std::unique_ptr<Differential> by_inputs_, by_states_;
    std::vector<std::tuple<int, int, int>> flows_; ///< in both, as the next ones
    std::set<int> differenced_, kinks_;
    std::vector<std::vector<std::pair<int, int>>> readers_; ///< by node: slot, reader
    std::optional<std::set<int>> between_;                  ///< nodes; none: all of them
    std::vector<int> kept_;                                 ///< elements of all states that the result has
    NodeSet on_path_;
    std::set<int> behind_outputs_;
    std::vector<std::vector<int>> sources_; ///< by node that reads them, in both passes
    std::vector<std::string> input_names_, output_names_;
    std::set<int> sampled_; ///< rates
    bool has_continuous_ = false, has_memory_ = false, holds_a_loop_ = false;
    LinearSystem system_;
};

} // namespace

struct Linearizer::Content {
    Content(Simulation& r, LinearizeOptions o) : run(r), options(std::move(o)), as_asked(run, options) {}

    LinearSystem linearize() {
        LinearSystem system;
        const Status status = step_with(run, [&] {
            // Differences write over what outputs and states were.
            saved.resize(run.context().snapshot_size());
            run.context().save(saved.data());
            system = as_asked();
            run.context().restore(saved.data());
            if (!as_asked.holds_a_loop()) return;
            if (!uncut) {
                auto closed = options;
                for (const auto& name : options.from) std::erase(closed.open, name);
                uncut.emplace(run, closed);
            }
            system.is_stable_uncut = is_stable((*uncut)());
            run.context().restore(saved.data());
        });
        if (!status) throw RunError(run.failure());
        return system;
    }

    Simulation& run;
    const LinearizeOptions options;
    Linearization as_asked;
    std::optional<Linearization> uncut; ///< where a signal that is cut is input and output
    std::vector<std::byte> saved;
};

Linearizer::Linearizer(Simulation& run, LinearizeOptions options)
    : content_(std::make_unique<Content>(run, std::move(options))) {}
Linearizer::~Linearizer() = default;
Linearizer::Linearizer(Linearizer&&) noexcept = default;
Linearizer& Linearizer::operator=(Linearizer&&) noexcept = default;
const LinearizeOptions& Linearizer::options() const { return content_->options; }

LinearSystem Linearizer::operator()() { return content_->linearize(); }

LinearSystem linearize(Simulation& run, const LinearizeOptions& options) {
    return Linearizer(run, options)();
}

LinearSystem linearize(const Diagram& diagram, const LinearizeOptions& options, double time) {
    Simulation run(diagram);
    run.start();
    if (!run.run_until(time)) throw RunError(run.failure());
    return linearize(run, options);
}

} // namespace bf::analysis
