#include "bf/engine/snapshot.hpp"

#include "bf/core/hash.hpp"

#include <cstring>
#include <string_view>
#include <type_traits>

namespace bf {

namespace {

using Bytes = std::span<const std::byte>;

constexpr std::string_view magic = "bf-snapshot\n";
constexpr std::uint32_t byte_order = 0x01020304, version = 4;

/// Hashes values one after the other; texts with their length, so that no two sequences look alike.
class Hash {
  public:
    template <class T>
    requires std::is_arithmetic_v<T> || std::is_enum_v<T> Hash& operator<<(T value) {
        value_ = fnv1a(std::as_bytes(std::span(&value, 1)), value_);
        return *this;
    }
    Hash& operator<<(std::string_view text) {
        *this << text.size();
        value_ = fnv1a(std::as_bytes(std::span(text)), value_);
        return *this;
    }
    Hash& operator<<(const Node::End& end) { return *this << end.node << end.slot; }
    std::uint64_t value() const { return value_; }

  private:
    std::uint64_t value_ = fnv1a({});
};

void add(Hash& hash, const std::vector<Call>& rules) {
    hash << rules.size();
    for (const auto& rule : rules) {
        hash << rule.kernel << rule.list_size;
        for (const auto& operand : rule.operands) {
            hash << operand.source << operand.slot;
            if (operand.constants)
                for (const double x : *operand.constants) hash << x;
        }
    }
}

void add(Hash& hash, const std::vector<Segment>& segments) {
    hash << segments.size();
    for (const auto& segment : segments) {
        hash << segment.rate << segment.condition;
        for (const auto& activity : segment.activities)
            hash << activity.node << activity.index << activity.condition << activity.loop;
    }
}

class ByteWriter {
  public:
    template <class T> void put(T value) { put(std::as_bytes(std::span(&value, 1))); }
    void put(Bytes bytes) { content.insert(content.end(), bytes.begin(), bytes.end()); }
    void put_block(Bytes bytes) {
        put(std::uint64_t{bytes.size()});
        put(bytes);
    }
    std::vector<std::byte> content;
};

class ByteReader {
  public:
    ByteReader(Bytes bytes, const std::string& name) : bytes_(bytes), name_(name) {}
    Bytes take(std::uint64_t count) {
        if (count > bytes_.size())
            fail("ends within its content: it was cut; make it again with bf run --snapshot");
        const Bytes taken = bytes_.first(count);
        bytes_ = bytes_.subspan(count);
        return taken;
    }
    template <class T> T get() {
        T value;
        std::memcpy(&value, take(sizeof value).data(), sizeof value);
        return value;
    }
    Bytes block() { return take(get<std::uint64_t>()); }
    Bytes rest() const { return bytes_; }
    [[noreturn]] void fail(const std::string& what) const {
        throw RunError("the snapshot '" + name_ + "' " + what);
    }

  private:
    Bytes bytes_;
    const std::string& name_;
};

template <class Visit> void for_each_parameter(const Diagram& diagram, Visit&& visit) {
    for (const auto& node : diagram.nodes)
        for (const auto& slot : node.block->declaration().slots)
            if (slot.role == Role::parameter) visit(node, slot);
}

std::vector<std::byte> value_of(const Slot& slot) {
    std::vector<std::byte> bytes(static_cast<std::size_t>(slot.size.count() * bf::bytes(slot.type)));
    write_values(bytes.data(), slot.type, slot.size.count(), slot.initial);
    return bytes;
}

/// The values that the diagram, not the run, gives its parameters.
std::vector<std::byte> given_parameters(const Diagram& diagram) {
    std::vector<std::byte> all;
    for_each_parameter(diagram, [&](const DiagramNode&, const Slot& slot) {
        const auto bytes = value_of(slot);
        all.insert(all.end(), bytes.begin(), bytes.end());
    });
    return all;
}

} // namespace

std::uint64_t fingerprint(const Diagram& diagram) {
    Hash hash;
    hash << diagram.step << diagram.solver.method << diagram.nodes.size();
    for (const auto& node : diagram.nodes) {
        const Declaration& d = node.block->declaration();
        hash << node.path << node.type << node.condition << node.rate << d.slots.size();
        for (const auto& slot : d.slots)
            hash << slot.role << slot.name << slot.type << slot.size.rows << slot.size.cols;
        for (const auto& source : node.sources) hash << source;
        for (const auto& provider : node.providers) hash << provider;
        for (const auto* rules : {&d.output_rules, &d.update_rules, &d.derivative_rules, &d.guard_rules})
            add(hash, *rules);
    }
    for (const auto& rate : diagram.rates)
        hash << rate.ticks << rate.offset << rate.is_constant << rate.is_continuous << rate.trigger;
    for (const auto& condition : diagram.conditions)
        hash << condition.path << condition.parent << condition.enable << condition.trigger << condition.reset
             << condition.trigger_edge << condition.reset_edge << condition.loop << condition.resets_states;
    for (const auto& loop : diagram.plan.loops) {
        hash << loop.kind << loop.path << loop.parent << loop.condition << loop.rate << loop.iterations
             << loop.count << loop.initial << loop.again;
        for (const auto& end : loop.unknowns) hash << end;
        add(hash, loop.outputs);
        add(hash, loop.updates);
    }
    const Plan& plan = diagram.plan;
    for (const auto* phase : {&plan.outputs, &plan.updates, &plan.derivatives, &plan.guards})
        add(hash, *phase);
    return hash.value();
}

std::vector<std::byte> make_snapshot(const Simulation& simulation) {
    const Diagram& diagram = simulation.diagram();
    ByteWriter content;
    content.put(fingerprint(diagram));
    content.put_block(std::as_bytes(std::span(diagram.name)));
    content.put(simulation.steps());
    content.put_block(given_parameters(diagram));
    content.put_block(simulation.snapshot());

    ByteWriter file;
    file.put(std::as_bytes(std::span(magic)));
    file.put(byte_order);
    file.put(version);
    file.put(fnv1a(content.content));
    file.put_block(content.content);
    return std::move(file.content);
}

void restore_snapshot(Simulation& simulation, Bytes snapshot, const std::string& name) {
    ByteReader file(snapshot, name);
    if (snapshot.size() < magic.size() || std::memcmp(snapshot.data(), magic.data(), magic.size()) != 0)
        file.fail("is no snapshot: it does not begin as one; bf run --snapshot writes them");
    file.take(magic.size());
    if (file.get<std::uint32_t>() != byte_order)
        file.fail("was made on a machine with another byte order; make it again on this one");
    if (const auto its = file.get<std::uint32_t>(); its != version)
        file.fail("has version " + std::to_string(its) + ", but this program reads version " +
                  std::to_string(version) + "; make it again with this program");
    const auto checksum = file.get<std::uint64_t>();
    const Bytes all = file.block();
    if (!file.rest().empty() || fnv1a(all) != checksum) file.fail("is damaged: its checksum is wrong");

    const Diagram& diagram = simulation.diagram();
    ByteReader content(all, name);
    const auto its_fingerprint = content.get<std::uint64_t>();
    const Bytes model = content.block();
    const std::string its_name(reinterpret_cast<const char*>(model.data()), model.size());
    if (its_name != diagram.name)
        content.fail("belongs to the model '" + its_name + "', not to '" + diagram.name + "'");
    if (its_fingerprint != fingerprint(diagram))
        content.fail("belongs to another version of '" + diagram.name +
                     "': blocks, sizes, types, rates or connections differ; only values of parameters may");
    content.get<std::int64_t>(); // steps: for who looks at the file without the model
    ByteReader given(content.block(), name);
    const Bytes state = content.block();
    simulation.restore({state.begin(), state.end()});
    for_each_parameter(diagram, [&](const DiagramNode& node, const Slot& slot) {
        const auto now = value_of(slot);
        const Bytes then = given.take(now.size());
        if (now.empty() || std::memcmp(now.data(), then.data(), now.size()) == 0) return;
        simulation.set_parameter(node.path + "." + slot.name,
                                 slot.initial.empty() ? std::vector<double>{0} : slot.initial);
    });
}

} // namespace bf
