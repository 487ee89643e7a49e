// Sizes and types spread along the wires, forwards and backwards, until nothing new is learned.
#include "bf/model/edit.hpp"
#include "stages.hpp"

#include <algorithm>
#include <deque>
#include <unordered_set>

namespace bf::elaboration {

namespace {

class Spreading {
  public:
    explicit Spreading(Elaboration& elaboration) : e_(elaboration), queued_(e_.diagram.nodes.size(), true) {
        consumers_.resize(queued_.size());
        for (std::size_t n = 0; n < queued_.size(); ++n) {
            queue_.push_back(static_cast<int>(n));
            for (std::size_t i = 0; i < e_.diagram.nodes[n].sources.size(); ++i)
                if (const auto& from = e_.diagram.nodes[n].sources[i]; from.node >= 0)
                    consumers_[static_cast<std::size_t>(from.node)].push_back(
                        {static_cast<int>(n), static_cast<int>(i)});
        }
    }

    void run() {
        const bool is_right = e_.report.is_empty();
        drain();
        // Where the wiring alone does not decide, in document order: what ports declare, then the usual
        // meaning.
        for (const auto& declared : e_.declared) {
            if (declared.end.node < 0) continue;
            const Slot& slot =
                e_.resolution(declared.end.node).slots[static_cast<std::size_t>(declared.end.slot)];
            if (declared.size && !slot.size_known)
                decide(declared.end.node, declared.end.slot, *declared.size);
            if (declared.type && !slot.type_known)
                decide(declared.end.node, declared.end.slot, *declared.type);
        }
        for_each_slot([&](int n, int i, const Slot& slot) {
            if (!slot.type_known) decide(n, i, Type::float64); // numbers are double
        });
        for_each_slot([&](int n, int, const Slot& slot) {
            if (!slot.size_known && slot.initial_from >= 0) take_initial_size(n, slot);
        });
        // In a wrong model what is open is not so for want of a wire.
        for_each_slot([&](int n, int i, const Slot& slot) {
            const bool is_unwired_input =
                slot.role == Role::input && e_.node(n).sources[static_cast<std::size_t>(i)].node < 0;
            const bool is_root_input =
                slot.role == Role::output && e_.node(n).block->declaration().traits.is_root_input;
            if (is_right && !slot.size_known && (is_unwired_input || is_root_input)) decide(n, i, Size{});
        });
        // A single number expands where something else decides a length; where nothing does, it is all there
        // is.
        for_each_slot([&](int n, int i, const Slot& slot) {
            if (is_right && !slot.size_known && slot.role == Role::parameter && slot.initial.size() == 1)
                decide(n, i, Size{1, 1, slot.shape.is_matrix});
        });
        // An algebraic loop of blocks that do not know their sizes is a loop first of all; another loop in
        // which nothing has a size carries scalars.
        if (is_right && std::any_of(e_.diagram.nodes.begin(), e_.diagram.nodes.end(), [](const auto& node) {
                return !unresolved(node.block->resolution()).empty();
            })) {
            if (!e_.diagram.solves_algebraic_loops) sort(e_);
            for_each_slot([&](int n, int i, const Slot& slot) {
                const auto& sources = e_.node(n).sources;
                const bool is_wired = std::any_of(sources.begin(), sources.end(),
                                                  [](const auto& from) { return from.node >= 0; });
                if (e_.report.is_empty() && !slot.size_known && slot.role == Role::output && is_wired)
                    decide(n, i, Size{});
            });
        }
        for (std::size_t n = 0; n < queued_.size(); ++n) report_open(static_cast<int>(n));
        for (std::size_t n = 0; n < queued_.size(); ++n) report_crossed(static_cast<int>(n));
        if (e_.report.is_empty())
            for (const auto& declared : e_.declared) {
                check_declared(declared);
                keep_names(declared);
            }
        keep_value_names();
        if (e_.report.is_empty())
            for (auto& condition : e_.diagram.conditions)
                for (const auto& outlet : condition.outlets) check_initial(outlet);
    }

  private:
    void push(int node) {
        if (queued_[static_cast<std::size_t>(node)]) return;
        queued_[static_cast<std::size_t>(node)] = true;
        queue_.push_back(node);
    }

    template <class F> void for_each_slot(F&& f) {
        for (std::size_t n = 0; n < queued_.size(); ++n) {
            const auto& slots = e_.resolution(static_cast<int>(n)).slots;
            for (std::size_t i = 0; i < slots.size(); ++i)
                f(static_cast<int>(n), static_cast<int>(i), slots[i]);
        }
    }

    /// Settles what nothing else decides, and what follows from it.
    template <class News> void decide(int node, int slot, News news) {
        try {
            if (offer(e_.resolution(node), slot, news)) push(node);
        } catch (const ResolutionError& error) {
            report(node, error.what());
        }
        drain();
    }

    /// In a loop whose size nothing else decides, a state has the size of its initial value.
    void take_initial_size(int node, const Slot& state) {
        const Resolution& r = e_.resolution(node);
        const Slot& initial = r.slots[static_cast<std::size_t>(state.initial_from)];
        if (!initial.size_known) return;
        size_from_ = e_.node(node).path + "." + initial.name;
        for (const int input : sized_by_initial(r, state))
            if (!r.slots[static_cast<std::size_t>(input)].size_known) decide(node, input, initial.size);
    }

    void check_declared(const Elaboration::Declared& declared) {
        if (declared.end.node < 0) return;
        const Slot& slot = e_.diagram.slot(declared.end);
        const auto differs = [&](const std::string& wanted, const std::string& found) {
            e_.report.add(declared.port->where, declared.path,
                          "the port is declared as " + wanted + ", but " + e_.diagram.end_path(declared.end) +
                              " is " + found,
                          "change one of them");
        };
        if (declared.size && (declared.size->rows != slot.size.rows || declared.size->cols != slot.size.cols))
            differs("size " + declared.size->text(), "of size " + slot.size.text());
        if (declared.type && *declared.type != slot.type)
            differs(std::string("type ") + bf::name(*declared.type),
                    std::string("of type ") + bf::name(slot.type));
    }

    void keep_names(const Elaboration::Declared& declared) {
        if (declared.end.node < 0 || !declared.enumeration) return;
        EnumeratedSignal named{declared.end, {}};
        for (const auto& [name, value] : declared.enumeration->fields())
            named.names.emplace_back(value.scalar(), name);
        e_.diagram.enumerated.push_back(std::move(named));
    }

    /// Of outputs whose numbers stand for names.
    void keep_value_names() {
        for (int n = 0; n < static_cast<int>(e_.diagram.nodes.size()); ++n) {
            const auto& slots = e_.resolution(n).slots;
            for (int i = 0; i < static_cast<int>(slots.size()); ++i) {
                const Slot& slot = slots[static_cast<std::size_t>(i)];
                if (slot.role != Role::output || slot.value_names.empty()) continue;
                EnumeratedSignal named{{n, i}, {}};
                for (const auto& name : slot.value_names)
                    named.names.emplace_back(static_cast<double>(named.names.size() + 1), name);
                e_.diagram.enumerated.push_back(std::move(named));
            }
        }
    }

    static std::vector<double> values_of(const std::vector<double>& initial) {
        return initial.empty() ? std::vector<double>{0} : initial;
    }

    void check_initial(const Condition::Outlet& outlet) {
        const Slot& slot = e_.diagram.slot(outlet.end);
        if (const auto wrong = outside(slot.type, values_of(outlet.initial)); !wrong.empty())
            e_.report.add(e_.node(outlet.end.node).where, e_.node(outlet.end.node).path, "'initial' " + wrong,
                          std::string("it has the type of the signal, ") + bf::name(slot.type));
        const int count = slot.size.count();
        const int given = static_cast<int>(outlet.initial.size());
        if (given <= 1 || given == count) return;
        const auto& node = e_.node(outlet.end.node);
        e_.report.add(node.where, node.path,
                      "'initial' has " + std::to_string(given) + " elements, but the output has " +
                          std::to_string(count),
                      "give one element or " + std::to_string(count));
    }

    void drain() {
        while (!queue_.empty()) {
            const int n = queue_.front();
            queue_.pop_front();
            queued_[static_cast<std::size_t>(n)] = false;
            try {
                if (e_.resolution(n).is_bound()) propagate(*e_.node(n).block);
            } catch (const TypeError& error) {
                report(n, error.what(), converted(n, 0));
            } catch (const std::exception& error) { // also what a resource says, e.g. an unknown frame
                report(n, error.what());
            }
            for (const auto& to : consumers_[static_cast<std::size_t>(n)])
                share(e_.node(to.node).sources[static_cast<std::size_t>(to.slot)], to);
            const auto& sources = e_.node(n).sources;
            for (std::size_t i = 0; i < sources.size(); ++i)
                if (sources[i].node >= 0) share(sources[i], {n, static_cast<int>(i)});
        }
    }

    /// One wire: each end learns from the other.
    void share(const Node::End& from, const Node::End& to) {
        auto& source = e_.resolution(from.node);
        auto& target = e_.resolution(to.node);
        Slot& a = source.slots[static_cast<std::size_t>(from.slot)];
        Slot& b = target.slots[static_cast<std::size_t>(to.slot)];
        const auto tell = [&](Resolution& r, const Node::End& end, auto news) {
            try {
                if (offer(r, end.slot, news)) push(end.node);
            } catch (const ResolutionError& error) {
                const bool is_of_types = dynamic_cast<const TypeError*>(&error) != nullptr;
                if (is_told(to, is_of_types ? 3 : 2)) return; // what both ends say is one thing
                report(to.node,
                       std::string(error.what()) + " (" + e_.diagram.end_path(from) + " -> " +
                           e_.diagram.end_path(to) + ")",
                       is_of_types ? conversions(from, to) : std::vector<model::Fix>());
            }
        };
        if (a.size_known && !(b.size_known && b.size == a.size) && !is_told(to, 0))
            tell(target, to, a.size);
        else if (!a.size_known && b.size_known)
            tell(source, from, b.size);
        const auto type_of_a = source.type_of(from.slot), type_of_b = target.type_of(to.slot);
        if (type_of_a && !is_told(to, 1))
            tell(target, to, *type_of_a);
        else if (!type_of_a && type_of_b)
            tell(source, from, *type_of_b);
    }

    /// Each input hears its source's size (0) and type (1) once, and of each is reported once (2, 3).
    bool is_told(const Node::End& to, int what) {
        const std::uint64_t key =
            (static_cast<std::uint64_t>(to.node) << 24 | static_cast<std::uint64_t>(to.slot) << 2) |
            static_cast<std::uint64_t>(what);
        return !told_.insert(key).second;
    }

    void report(int node, const std::string& text, std::vector<model::Fix> fixes = {}) {
        if (!reported_.insert(text + e_.node(node).path).second) return;
        const model::Block* const block = model::find(e_.model, e_.node(node).path);
        e_.report.add(block ? place_of_row(*block, text) : e_.node(node).where, e_.node(node).path, text,
                      size_from_.empty() ? ""
                                         : "if the loop has another size than '" + size_from_ +
                                               "', give that parameter as many elements as the signal",
                      std::move(fixes));
    }

    // ---- conversions that mend types ----

    std::vector<model::Fix> converted(int node, const std::vector<std::string>& inputs, Type type) const {
        std::string all;
        for (const auto& input : inputs) all += (all.empty() ? "" : ", ") + input;
        model::Block convert{.name = "convert", .type = "Convert"};
        if (type != Type::float64) // which it makes anyway
            convert.settings.push_back({.name = "type", .value = {.text = bf::name(type)}, .where = {}});
        return inserted_before(e_.model, e_.node(node).path, inputs,
                               std::string("Convert to ") + bf::name(type) + " before " + all,
                               std::move(convert));
    }
    /// Wired inputs of a kind whose sources are of that type, if one is given.
    std::vector<std::string> inputs_of(int node, int type_symbol, std::optional<Type> type = {}) const {
        std::vector<std::string> inputs;
        const auto& sources = e_.node(node).sources;
        const auto& slots = e_.diagram.nodes[static_cast<std::size_t>(node)].block->resolution().slots;
        for (std::size_t i = 0; i < sources.size(); ++i)
            if (sources[i].node >= 0 && slots[i].type_symbol == type_symbol &&
                (!type || e_.resolution(sources[i].node).type_of(sources[i].slot) == type))
                inputs.push_back(slots[i].name);
        return inputs;
    }
    /// Numbers of that kind become double, with which everything works.
    std::vector<model::Fix> converted(int node, int type_symbol) const {
        return converted(node, inputs_of(node, type_symbol), Type::float64);
    }
    /// In that wire, or in those of the other inputs of its kind: first what loses fewer numbers.
    std::vector<model::Fix> conversions(const Node::End& from, const Node::End& to) const {
        const Resolution& r = e_.resolution(to.node);
        const Slot& input = r.slots[static_cast<std::size_t>(to.slot)];
        const Type sent = *e_.resolution(from.node).type_of(from.slot), wanted = *r.type_of(to.slot);
        std::vector<model::Fix> fixes = converted(to.node, {input.name}, wanted);
        if (input.type_symbol < 0) return fixes;
        const auto others = converted(to.node, inputs_of(to.node, input.type_symbol, wanted), sent);
        fixes.insert(sent < wanted ? fixes.begin() : fixes.end(), others.begin(),
                     others.end()); // widest first
        return fixes;
    }

    /// Parameters that are below the ones that they must be at least.
    void report_crossed(int n) {
        const Resolution& r = e_.resolution(n);
        for (int i = 0; i < static_cast<int>(r.slots.size()); ++i) {
            const auto wrong = below_another(r, i);
            if (wrong.empty()) continue;
            auto written = e_.written_parameters.find({n, i});
            if (written == e_.written_parameters.end())
                written = e_.written_parameters.find({n, r.slots[static_cast<std::size_t>(i)].at_least});
            e_.report.add(written == e_.written_parameters.end() ? e_.node(n).where : written->second,
                          e_.node(n).path, wrong, "exchange the two, or give others");
        }
    }

    void report_open(int n) {
        if (!e_.report.is_empty()) return; // what is open then follows from what was reported
        const Resolution& r = e_.resolution(n);
        for (const int i : unresolved(r)) {
            const Slot& slot = r.slots[static_cast<std::size_t>(i)];
            e_.report.add(e_.node(n).where, e_.node(n).path,
                          std::string("the size of ") + name(slot.role) + " '" + slot.name +
                              "' cannot be found from the wiring",
                          "connect the block, or give a parameter with the wanted size");
        }
        for (std::size_t i = 0; i < r.slots.size(); ++i) {
            const Slot& slot = r.slots[i];
            const int count = slot.size.count();
            if (slot.role == Role::parameter && slot.type_symbol >= 0) // the types of others were known
                if (const auto wrong = outside_limits(slot, values_of(slot.initial)); !wrong.empty()) {
                    const auto written = e_.written_parameters.find({n, static_cast<int>(i)});
                    const auto& at =
                        written == e_.written_parameters.end() ? e_.node(n).where : written->second;
                    const std::string remedy = outside_remedy(slot);
                    e_.report.add(at, e_.node(n).path, wrong, remedy,
                                  remedy.empty() ? std::vector<model::Fix>()
                                                 : converted(n, slot.type_symbol));
                }
            const auto& sources = e_.node(n).sources;
            const bool is_connected = slot.role == Role::input && i < sources.size() && sources[i].node >= 0;
            if (const auto wrong = wrong_size(slot, is_connected); !wrong.empty())
                e_.report.add(e_.node(n).where, e_.node(n).path, wrong,
                              slot.initial.size() > 1 ? "give one element or " + std::to_string(count)
                                                      : "give it less");
            if (slot.initial_from >= 0) {
                const Slot& from = r.slots[static_cast<std::size_t>(slot.initial_from)];
                if (from.size.count() != 1 && from.size.count() != count)
                    e_.report.add(e_.node(n).where, e_.node(n).path,
                                  "parameter '" + from.name + "' has " + std::to_string(from.size.count()) +
                                      " elements, but the state '" + slot.name + "' needs " +
                                      std::to_string(count),
                                  "give one element or " + std::to_string(count));
            }
        }
        for (const Phase phase : phases)
            for (const Call& call : r.declaration().rules(phase))
                if (call.symbols == 1 && !call.run[static_cast<std::size_t>(*r.types[0])])
                    e_.report.add(e_.node(n).where, e_.node(n).path,
                                  "the block does not work on signals of type " +
                                      std::string(bf::name(*r.types[0])),
                                  "insert a Convert block before it", converted(n, 0));
    }

    Elaboration& e_;
    std::deque<int> queue_;
    std::vector<bool> queued_;
    std::vector<std::vector<Node::End>> consumers_;
    std::unordered_set<std::uint64_t> told_;
    std::unordered_set<std::string> reported_;
    std::string size_from_; ///< the initial value whose size a loop took last, since nothing else told one
};

} // namespace

void infer_shapes(Elaboration& e) { Spreading(e).run(); }

} // namespace bf::elaboration
