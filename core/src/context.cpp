#include "bf/core/context.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>

namespace bf {

namespace {
constexpr std::size_t alignment = 64;      // a line of the cache
constexpr std::size_t register_bytes = 32; // of the widest registers that kernels are compiled for
template <class N> constexpr N rounded_up(N n, N multiple) {
    return (n + multiple - 1) / multiple * multiple;
}

std::size_t slot_bytes(const Slot& slot) {
    return static_cast<std::size_t>(slot.size.count()) * static_cast<std::size_t>(bytes(slot.type));
}
} // namespace

/// Memory handed out in order; addresses are final once `allocate` was called.
struct Context::Arena {
    std::size_t size = 0;
    std::unique_ptr<std::byte[]> memory;

    /// Scalars are packed, arrays aligned for vector instructions and to touch few lines of the cache.
    std::size_t reserve(std::size_t count, std::size_t element) {
        const std::size_t align =
            count > element ? std::min(std::bit_floor(count), alignment) : std::max<std::size_t>(element, 1);
        const std::size_t offset = rounded_up(size, align);
        size = offset + count;
        return offset;
    }
    /// The same with arrays in registers of their own: what stands behind their last element is nobody's.
    std::size_t reserve_whole(std::size_t count, std::size_t element) {
        return reserve(count > element ? rounded_up(count, register_bytes) : count, element);
    }
    void allocate() { memory = std::make_unique<std::byte[]>(size + alignment); }
    std::byte* begin() const {
        const auto address = reinterpret_cast<std::uintptr_t>(memory.get());
        return memory.get() + ((address + alignment - 1) / alignment * alignment - address);
    }
};

struct Context::MethodCall {
    const Block* block;
    const Frame* frame;
};

void write_values(void* to, Type type, int count, const std::vector<double>& values) {
    with_type(type, [&](auto t) {
        using T = typename decltype(t)::type;
        for (int i = 0; i < count; ++i) {
            double x = values.empty() ? 0.0 : values[values.size() == 1 ? 0 : static_cast<std::size_t>(i)];
            if constexpr (std::is_same_v<T, bool>)
                static_cast<T*>(to)[i] = x != 0;
            else if constexpr (std::is_integral_v<T>) {
                x = std::isnan(x) ? 0.0 : std::round(x);
                static_cast<T*>(to)[i] = static_cast<T>(
                    std::clamp<double>(x, std::numeric_limits<T>::min(), std::numeric_limits<T>::max()));
            } else
                static_cast<T*>(to)[i] = static_cast<T>(x);
        }
    });
}

double read_value(const void* from, Type type, int i) {
    return with_type(type, [&](auto t) {
        return static_cast<double>(static_cast<const typename decltype(t)::type*>(from)[i]);
    });
}

Context::Context(const std::vector<Node>& nodes, int clocks)
    : nodes_(nodes), clocks_(static_cast<std::size_t>(clocks)), signals_(std::make_unique<Arena>()),
      parameters_(std::make_unique<Arena>()), discrete_(std::make_unique<Arena>()),
      discrete_next_(std::make_unique<Arena>()), continuous_(std::make_unique<Arena>()),
      continuous_next_(std::make_unique<Arena>()), rates_(std::make_unique<Arena>()),
      work_(std::make_unique<Arena>()) {
    // First pass: where each slot lies. The next state mirrors the state, so both have the same offset.
    std::vector<std::size_t> offsets;
    std::size_t slots = 0, objects = 0;
    for (const Node& node : nodes_) {
        const auto& of_block = node.block->resolution().slots;
        slots += of_block.size();
        objects += node.block->declaration().objects.size();
        for (std::size_t i = 0; i < of_block.size(); ++i) {
            const Slot& slot = of_block[i];
            const auto element = static_cast<std::size_t>(bytes(slot.type));
            const auto reserve = [&](Arena& arena) {
                offsets.push_back(arena.reserve_whole(slot_bytes(slot), element));
            };
            switch (slot.role) {
            case Role::input:
                if (i < node.sources.size() && node.sources[i].node >= 0)
                    offsets.push_back(0);
                else
                    reserve(*signals_);
                break;
            case Role::output: reserve(*signals_); break;
            case Role::parameter: reserve(*parameters_); break;
            case Role::discrete_state: reserve(*discrete_); break;
            case Role::continuous_state: // solvers see all of the memory
                offsets.push_back(continuous_->reserve(slot_bytes(slot), element));
                break;
            case Role::workspace:
            case Role::guard: reserve(*work_); break;
            }
        }
    }
    discrete_next_->size = discrete_->size;
    continuous_next_->size = rates_->size = continuous_->size;
    for (Arena* arena : {signals_.get(), parameters_.get(), discrete_.get(), discrete_next_.get(),
                         continuous_.get(), continuous_next_.get(), rates_.get(), work_.get()})
        arena->allocate();

    // Second pass: tables of pointers, three per slot, and the objects.
    pointers_.assign(3 * slots + objects, nullptr);
    sizes_.resize(slots);
    connected_.resize(slots);
    frames_.resize(nodes_.size());
    void** table = pointers_.data();
    Size* size = sizes_.data();
    std::uint8_t* connected = connected_.data();
    std::size_t k = 0;
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
        const auto& of_block = nodes_[n].block->resolution().slots;
        const std::size_t count = of_block.size();
        void **now = table, **next = table + count, **rate = table + 2 * count, **object = table + 3 * count;
        table += 3 * count + nodes_[n].block->declaration().objects.size();
        frames_[n] = {now,      next, rate, size, object, &clocks_[static_cast<std::size_t>(nodes_[n].clock)],
                      connected};
        for (std::size_t i = 0; i < count; ++i, ++k) {
            const Slot& slot = of_block[i];
            size[i] = slot.size;
            connected[i] = i < nodes_[n].sources.size() && nodes_[n].sources[i].node >= 0;
            switch (slot.role) {
            case Role::input:
            case Role::output: now[i] = signals_->begin() + offsets[k]; break;
            case Role::parameter: now[i] = parameters_->begin() + offsets[k]; break;
            case Role::discrete_state:
                now[i] = discrete_->begin() + offsets[k];
                next[i] = discrete_next_->begin() + offsets[k];
                break;
            case Role::continuous_state:
                now[i] = continuous_->begin() + offsets[k];
                next[i] = continuous_next_->begin() + offsets[k];
                rate[i] = rates_->begin() + offsets[k];
                break;
            case Role::workspace:
            case Role::guard: now[i] = work_->begin() + offsets[k]; break;
            }
            if ((slot.role == Role::input && !connected[i]) || slot.role == Role::parameter)
                write_values(now[i], slot.type, slot.size.count(), slot.initial);
        }
        size += count;
        connected += count;
    }
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
        const auto& d = nodes_[n].block->declaration();
        const auto& provided = nodes_[n].block->resolution().provided;
        auto** now = const_cast<void**>(frames_[n].now);
        for (std::size_t i = 0; i < nodes_[n].sources.size(); ++i)
            if (const auto& from = nodes_[n].sources[i]; from.node >= 0) now[i] = data(from.node, from.slot);
        for_each_own_object(nodes_[n], [&](std::size_t i) {
            const auto& [make, requirement, provision] = d.objects[i];
            const auto r = static_cast<std::size_t>(requirement), p = static_cast<std::size_t>(provision);
            const auto& [borrowed, shared] = std::tie(nodes_[n].borrowed, nodes_[n].shared);
            Object made;
            if (nodes_[n].awaits_objects) {
                // It comes by an exchange.
            } else if (requirement >= 0) {
                made.pointer = borrowed[r]().pointer;
            } else if (provision >= 0) {
                made = p < shared.size() && shared[p] ? shared[p]() : d.provisions[p].open(provided[p].get());
            } else {
                made = make();
            }
            const_cast<void**>(frames_[n].objects)[i] = made.pointer.get();
            objects_.push_back(std::move(made));
            object_nodes_.push_back(static_cast<int>(n));
        });
    }
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
        const auto& d = nodes_[n].block->declaration();
        for (std::size_t i = 0; i < d.objects.size(); ++i)
            if (const int r = d.objects[i].requirement;
                r >= 0 && static_cast<std::size_t>(r) < nodes_[n].providers.size()) {
                const auto& from = nodes_[n].providers[static_cast<std::size_t>(r)];
                const auto& provided = nodes_[static_cast<std::size_t>(from.node)].block->declaration();
                for (std::size_t o = 0; o < provided.objects.size(); ++o)
                    if (provided.objects[o].provision == from.slot)
                        const_cast<void**>(frames_[n].objects)[i] =
                            frames_[static_cast<std::size_t>(from.node)].objects[o];
            }
    }
}

Context::~Context() = default;

template <class F> void Context::for_each_own_object(const Node& node, F&& f) {
    const auto& objects = node.block->declaration().objects;
    for (std::size_t i = 0; i < objects.size(); ++i) {
        const int r = objects[i].requirement;
        const bool is_borrowed = r >= 0 && static_cast<std::size_t>(r) < node.borrowed.size() &&
                                 node.borrowed[static_cast<std::size_t>(r)];
        if (r < 0 || is_borrowed) f(i);
    }
}

Object* Context::objects_of(int node) {
    const auto first = std::lower_bound(object_nodes_.begin(), object_nodes_.end(), node);
    return objects_.data() + (first - object_nodes_.begin());
}

Context::Exchange Context::exchange(Context& other, std::span<const std::pair<int, int>> nodes) {
    Exchange found;
    const auto pointer = [&](std::size_t node, std::size_t i) {
        return const_cast<void**>(frames_[node].objects) + i;
    };
    for (const auto& [of_this, of_other] : nodes) {
        const auto mine = static_cast<std::size_t>(of_this);
        const Node& node = nodes_[mine];
        const auto& objects = node.block->declaration().objects;
        Object *own = objects_of(of_this), *others = other.objects_of(of_other);
        for_each_own_object(node, [&](std::size_t i) {
            found.pairs.push_back({own, others});
            found.users.push_back({pointer(mine, i), own});
            for (std::size_t n = 0; n < nodes_.size(); ++n) {
                const auto& used = nodes_[n].block->declaration().objects;
                for (std::size_t k = 0; k < used.size(); ++k) {
                    const auto r = static_cast<std::size_t>(used[k].requirement);
                    if (used[k].requirement < 0 || r >= nodes_[n].providers.size()) continue;
                    const Node::End& from = nodes_[n].providers[r];
                    if (from.node == static_cast<int>(mine) && objects[i].provision == from.slot)
                        found.users.push_back({pointer(n, k), own});
                }
            }
            ++own;
            ++others;
        });
    }
    return found;
}

void Context::Exchange::make() noexcept {
    for (const auto& [own, other] : pairs) std::swap(*own, *other);
    for (const auto& [pointer, object] : users) *pointer = object->pointer.get();
}

void Context::use_memory(int node, int slot, const Memory& memory) {
    has_memory_outside_ = true;
    const Frame& frame = frames_[static_cast<std::size_t>(node)];
    const_cast<void**>(frame.now)[slot] = memory.now;
    if (memory.next) const_cast<void**>(frame.next)[slot] = memory.next;
    if (memory.rate) const_cast<void**>(frame.rate)[slot] = memory.rate;
    const_cast<std::uint8_t*>(frame.connected)[slot] = memory.connects;
}

namespace {

bool overrides(const Block::Methods& methods, Phase phase) {
    switch (phase) {
    case Phase::output: return methods.output;
    case Phase::update: return methods.update;
    case Phase::derivative: return methods.derivative;
    case Phase::guards: return methods.guards;
    case Phase::event: return methods.event;
    }
    return false;
}

} // namespace

int Context::activities(int node, Phase phase) const {
    const Node& n = nodes_[static_cast<std::size_t>(node)];
    return static_cast<int>(n.block->declaration().rules(phase).size()) + overrides(n.methods, phase);
}

namespace {

Size size_of(const Resolution& resolution, const Call::Reference& from) {
    return from.slot >= 0 ? resolution.slots[static_cast<std::size_t>(from.slot)].size : Size{};
}

/// Arithmetic on arrays of one size goes on to the end of their last register, so that no element is left
/// over: nobody reads the results there.
void fill_registers(const Call& call, const Resolution& resolution, Operand* operands) {
    int count = 1;
    for (const auto& from : call.operands) {
        const int own = size_of(resolution, from).count();
        if (own == 1) continue;
        const bool is_whole =
            resolution.slots[static_cast<std::size_t>(from.slot)].role != Role::continuous_state;
        if (!is_whole || (count > 1 && own != count)) return;
        count = own;
    }
    for (const auto& from : call.operands) // one for each element, or for each operand
        if (from.constants && from.constants->size() > 1 && static_cast<int>(from.constants->size()) == count)
            return;
    constexpr auto elements = static_cast<int>(register_bytes / sizeof(double));
    for (std::size_t i = 0; i < call.operands.size(); ++i)
        if (size_of(resolution, call.operands[i]).count() > 1)
            operands[i] = {operands[i].data, rounded_up(count, elements), 1};
}

} // namespace

Task Context::task(int node, Phase phase, int i) {
    const Node& n = nodes_[static_cast<std::size_t>(node)];
    const Frame& frame = frames_[static_cast<std::size_t>(node)];
    const Resolution& resolution = n.block->resolution();
    const auto& calls = n.block->declaration().rules(phase);
    if (i >= static_cast<int>(calls.size())) {
        calls_.push_back(std::make_unique<MethodCall>(MethodCall{n.block, &frame}));
        const auto run = [&]() -> Call::Run {
            switch (phase) {
            case Phase::output:
                return [](const void* p, int) {
                    const auto& m = *static_cast<const MethodCall*>(p);
                    return m.block->output(Now(*m.frame), Out(*m.frame));
                };
            case Phase::update:
                return [](const void* p, int) {
                    const auto& m = *static_cast<const MethodCall*>(p);
                    return m.block->update(Now(*m.frame), Next(*m.frame));
                };
            case Phase::derivative:
                return [](const void* p, int) {
                    const auto& m = *static_cast<const MethodCall*>(p);
                    return m.block->derivative(Now(*m.frame), Rate(*m.frame));
                };
            case Phase::guards:
                return [](const void* p, int) {
                    const auto& m = *static_cast<const MethodCall*>(p);
                    return m.block->guards(Now(*m.frame), Guards(*m.frame));
                };
            case Phase::event: break;
            }
            return [](const void* p, int) {
                const auto& m = *static_cast<const MethodCall*>(p);
                return m.block->event(Now(*m.frame), After(*m.frame));
            };
        }();
        return {run, calls_.back().get(), 0};
    }
    const Call& call = calls[static_cast<std::size_t>(i)];
    operands_.push_back(std::make_unique<Operand[]>(call.operands.size() + 1));
    Operand* operand = operands_.back().get();
    bool are_scalars = true;
    for (const auto& from : call.operands) {
        const Size size = size_of(resolution, from);
        are_scalars = are_scalars && size.count() == 1;
        switch (from.source) {
        case Call::Source::slot: *operand = {frame.now[from.slot], size.rows, size.cols}; break;
        case Call::Source::next: *operand = {frame.next[from.slot], size.rows, size.cols}; break;
        case Call::Source::rate: *operand = {frame.rate[from.slot], size.rows, size.cols}; break;
        case Call::Source::time: *operand = {const_cast<double*>(&frame.clock->time), 1, 1}; break;
        case Call::Source::period: *operand = {const_cast<double*>(&frame.clock->period), 1, 1}; break;
        case Call::Source::trigger: *operand = {const_cast<double*>(&frame.clock->trigger), 1, 1}; break;
        case Call::Source::constants:
            *operand = {const_cast<double*>(from.constants->data()), static_cast<int>(from.constants->size()),
                        1};
            break;
        }
        ++operand;
    }
    std::size_t version = 0;
    for (int symbol = 0; symbol < call.symbols; ++symbol) {
        const auto s = static_cast<std::size_t>(symbol);
        version = version * type_count +
                  (s < resolution.types.size()
                       ? static_cast<std::size_t>(resolution.types[s].value_or(Type::float64))
                       : 0);
    }
    if (version == 0 && call.is_arithmetic && !has_memory_outside_)
        fill_registers(call, resolution, operands_.back().get());
    const auto run = version > 0 || !call.run_widest   ? call.run[version]
                     : are_scalars && call.run_scalars ? call.run_scalars
                                                       : call.run_widest;
    return {run, operands_.back().get(), static_cast<int>(call.operands.size())};
}

bool join(Move& move, const Move& next) {
    const int count = move.count + next.count;
    const std::less_equal<const double*> is_before;
    const bool is_apart = is_before(move.from + count, move.to) || is_before(move.to + count, move.from);
    if (move.to + move.count != next.to || move.from + move.count != next.from || !is_apart) return false;
    move.count = count;
    return true;
}

/// The kernel runs once on operands whose elements are numbered: the numbers in its results say where they
/// come from.
std::vector<Move> Context::moves(const Task& task, int node, Phase phase, int i) const {
    const Node& n = nodes_[static_cast<std::size_t>(node)];
    const auto& calls = n.block->declaration().rules(phase);
    if (i >= static_cast<int>(calls.size()) || !calls[static_cast<std::size_t>(i)].is_move) return {};
    const auto& references = calls[static_cast<std::size_t>(i)].operands;
    const auto* const real = static_cast<const Operand*>(task.data);
    constexpr std::uint64_t numbered = 0x7ff8'bf00'0000'0000; // NaNs that no constant is
    std::vector<std::vector<double>> numbers(references.size());
    std::vector<Operand> operands(real, real + references.size());
    std::vector<const double*> places;
    for (std::size_t k = 0; k < references.size(); ++k) {
        if (references[k].constants) continue;
        if (references[k].slot < 0 ||
            n.block->resolution().slots[static_cast<std::size_t>(references[k].slot)].type != Type::float64)
            return {};
        for (int e = 0; e < real[k].rows * real[k].cols; ++e) {
            numbers[k].push_back(references[k].is_written ? 0
                                                          : std::bit_cast<double>(numbered + places.size()));
            if (!references[k].is_written) places.push_back(static_cast<const double*>(real[k].data) + e);
        }
        operands[k].data = numbers[k].data();
    }
    if (!task.run(operands.data(), task.count)) return {};
    std::vector<Move> all;
    for (std::size_t k = 0; k < references.size(); ++k) {
        if (!references[k].is_written) continue;
        auto* to = static_cast<double*>(real[k].data);
        for (const double number : numbers[k]) {
            const auto place = std::bit_cast<std::uint64_t>(number) - numbered;
            if (place >= places.size()) return {};
            const Move next{to++, places[place], 1};
            if (all.empty() || !join(all.back(), next)) all.push_back(next);
        }
    }
    return all;
}

/// x := x⁺ for all states of a node, which begin as x⁻, after `write`.
template <class F> Status Context::write_states(int node, F&& write) {
    const Frame& frame = frames_[static_cast<std::size_t>(node)];
    const auto& slots = nodes_[static_cast<std::size_t>(node)].block->resolution().slots;
    for (std::size_t i = 0; i < slots.size(); ++i)
        if (frame.next[i]) std::memcpy(frame.next[i], frame.now[i], slot_bytes(slots[i]));
    const Status status = write(frame);
    for (std::size_t i = 0; i < slots.size(); ++i)
        if (frame.next[i]) std::memcpy(frame.now[i], frame.next[i], slot_bytes(slots[i]));
    return status;
}

void Context::set(const Node::End& to, const Node::End& source, const std::vector<double>& values) {
    const auto slot_of = [&](const Node::End& end) -> const Slot& {
        return nodes_[static_cast<std::size_t>(end.node)].block->resolution().slots[static_cast<std::size_t>(
            end.slot)];
    };
    const Slot& slot = slot_of(to);
    auto* const memory = static_cast<std::byte*>(data(to.node, to.slot));
    if (source.node < 0) {
        write_values(memory, slot.type, slot.size.count(), values);
    } else {
        const auto* const from = static_cast<const std::byte*>(data(source.node, source.slot));
        const auto element = static_cast<std::size_t>(bytes(slot.type));
        const std::size_t stride = slot_of(source).size.count() == 1 ? 0 : element;
        for (std::size_t i = 0; i < static_cast<std::size_t>(slot.size.count()); ++i)
            std::memcpy(memory + i * element, from + i * stride, element);
    }
    if (void* const next = next_data(to.node, to.slot)) std::memcpy(next, memory, slot_bytes(slot));
}

void Context::set_states(int node) {
    for_each_initial(*nodes_[static_cast<std::size_t>(node)].block, node,
                     [&](const auto&... state) { set(state...); });
}

Status Context::reset(int node) {
    const Node& n = nodes_[static_cast<std::size_t>(node)];
    if (!n.methods.reset) return ok;
    return write_states(node, [&](const Frame& frame) { return n.block->reset(Now(frame), After(frame)); });
}

Status Context::event(int node, std::span<const Task> tasks) {
    return write_states(node, [&](const Frame&) {
        for (const Task& task : tasks)
            if (const Status status = task(); !status) return status;
        return ok;
    });
}

void Context::commit(int node) {
    const Frame& frame = frames_[static_cast<std::size_t>(node)];
    const auto& slots = nodes_[static_cast<std::size_t>(node)].block->resolution().slots;
    for (std::size_t i = 0; i < slots.size(); ++i)
        if (slots[i].role == Role::discrete_state)
            std::memcpy(frame.now[i], frame.next[i], slot_bytes(slots[i]));
}

void Context::start(int node) {
    nodes_[static_cast<std::size_t>(node)].block->start(Now(frames_[static_cast<std::size_t>(node)]));
}
void Context::stop(int node) noexcept {
    nodes_[static_cast<std::size_t>(node)].block->stop(Now(frames_[static_cast<std::size_t>(node)]));
}

std::span<double> Context::continuous_state() {
    return {reinterpret_cast<double*>(continuous_->begin()), continuous_->size / sizeof(double)};
}
std::span<double> Context::continuous_rate() {
    return {reinterpret_cast<double*>(rates_->begin()), rates_->size / sizeof(double)};
}

std::size_t Context::snapshot_size() const {
    std::size_t size = signals_->size + parameters_->size + discrete_->size + continuous_->size +
                       clocks_.size() * sizeof(Clock);
    for (const auto& object : objects_)
        if (object.state_size) size += object.state_size() * sizeof(double);
    return size;
}

void Context::save(std::byte* to) const {
    const auto put = [&](const void* from, std::size_t size) {
        if (size) std::memcpy(to, from, size);
        to += size;
    };
    for (const Arena* arena : {signals_.get(), parameters_.get(), discrete_.get(), continuous_.get()})
        put(arena->begin(), arena->size);
    put(clocks_.data(), clocks_.size() * sizeof(Clock));
    for (const auto& object : objects_)
        if (object.state_size) {
            object.save(reinterpret_cast<double*>(to));
            to += object.state_size() * sizeof(double);
        }
}

void Context::restore(const std::byte* from) {
    const auto get = [&](void* to, std::size_t size) {
        if (size) std::memcpy(to, from, size);
        from += size;
    };
    for (const Arena* arena : {signals_.get(), parameters_.get(), discrete_.get(), continuous_.get()})
        get(arena->begin(), arena->size);
    get(clocks_.data(), clocks_.size() * sizeof(Clock));
    for (const auto& object : objects_)
        if (object.state_size) {
            object.restore(reinterpret_cast<const double*>(from));
            from += object.state_size() * sizeof(double);
        }
    std::memcpy(discrete_next_->begin(), discrete_->begin(), discrete_->size);
}

int Context::refuses_snapshot() const {
    for (std::size_t i = 0; i < objects_.size(); ++i)
        if (objects_[i].is_outside && !objects_[i].state_size) return object_nodes_[i];
    return -1;
}

std::vector<int> Context::devices() const {
    std::vector<int> nodes;
    for (std::size_t n = 0; n < nodes_.size(); ++n) {
        const void* const* objects = frames_[n].objects;
        const std::size_t count = nodes_[n].block->declaration().objects.size();
        if (std::any_of(objects_.begin(), objects_.end(), [&](const Object& object) {
                return object.is_outside && !object.state_size && object.pointer &&
                       std::find(objects, objects + count, object.pointer.get()) != objects + count;
            }))
            nodes.push_back(static_cast<int>(n));
    }
    return nodes;
}

std::vector<int> Context::outside() const {
    std::vector<int> nodes;
    for (std::size_t i = 0; i < objects_.size(); ++i)
        if (objects_[i].is_outside && (nodes.empty() || nodes.back() != object_nodes_[i]))
            nodes.push_back(object_nodes_[i]);
    return nodes;
}

std::size_t Context::signal_bytes() const { return signals_->size; }
std::size_t Context::parameter_bytes() const { return parameters_->size; }
std::size_t Context::state_bytes() const { return discrete_->size + continuous_->size; }

} // namespace bf
