// How a block reads and writes its quantities in a step: reading and writing are different types.
#pragma once

#include "bf/core/declaration.hpp"

#include <cstdint>

namespace bf {

/// Time as a block sees it.
struct Clock {
    double time = 0;       ///< of this step [s]
    double period = 0;     ///< of the block's sample time [s]; 0 for a continuous block
    std::int64_t step = 0; ///< how often this rate was hit before
    double trigger = 0;    ///< 1 in a triggered subsystem, whose period is 0 when it runs again at once
};

/// Where the quantities of one block lie. Made by the engine; blocks see it through Now, Out, Next, ...
struct Frame {
    void* const* now = nullptr;     ///< one per slot; an input points at its source
    void* const* next = nullptr;    ///< one per slot, used for discrete states (and for both kinds in events)
    void* const* rate = nullptr;    ///< one per slot, used for continuous states
    const Size* sizes = nullptr;    ///< one per slot
    void* const* objects = nullptr; ///< workspaces, outside states, opened resources
    const Clock* clock = nullptr;
    const std::uint8_t* connected = nullptr; ///< one per slot: an input that reads another block's output
};

/// A typed name for one slot of one block. It stores no data.
template <class T, Role role> class Key {
  public:
    using Quantity = T;
    static constexpr Role its_role = role;

    Key(Block* owner, const char* name, const About& about = {});
    Key(Block* owner, const std::string& name, const About& about);
    int index() const { return index_; }
    /// False for an optional port that the arguments switched off.
    bool is_present() const { return index_ >= 0; }

  private:
    int index_;
};

template <class T = Any> using Input = Key<T, Role::input>;
template <class T = Any> using Output = Key<T, Role::output>;
template <class T = Any> using Parameter = Key<T, Role::parameter>;
template <class T = Any> using DiscreteState = Key<T, Role::discrete_state>;
template <class T = Vector> using ContinuousState = Key<T, Role::continuous_state>;
template <class T = Vector> using Workspace = Key<T, Role::workspace>;
/// A zero-crossing function, or a row of them with the shape of a signal. `guards` writes its value; in
/// `event` it reads +1 where it rose through zero, -1 where it fell, 0 elsewhere. One of type int32 counts,
/// and crosses wherever it changes: for edges of which several may lie in a step of a solver. It is for
/// blocks without `event`.
template <class T> using GuardOf = Key<T, Role::guard>;
using Guard = GuardOf<double>;

/// A row of ports of one kind: u1, u2, ... or the given names.
template <class T, Role role> class KeyList {
  public:
    KeyList(Block* owner, const char* stem, int count, const About& about = {}) {
        for (int i = 1; i <= count; ++i)
            keys_.emplace_back(owner, std::string(stem) + std::to_string(i), about);
    }
    KeyList(Block* owner, const std::vector<std::string>& names, const About& about = {}) {
        for (const auto& name : names) keys_.emplace_back(owner, name, about);
    }
    int size() const { return static_cast<int>(keys_.size()); }
    const Key<T, role>& operator[](int i) const { return keys_[static_cast<std::size_t>(i)]; }
    auto begin() const { return keys_.begin(); }
    auto end() const { return keys_.end(); }

  private:
    std::vector<Key<T, role>> keys_;
};
template <class T = Any> using InputList = KeyList<T, Role::input>;
template <class T = Any> using OutputList = KeyList<T, Role::output>;

/// A preallocated workspace; its content means nothing between two calls.
template <class T> class Scratch {
  public:
    Scratch(Block* owner, std::function<T()> make);
    int index() const { return index_; }

  private:
    int index_;
};

/// State that lives in a foreign object (a physics world, a device). A T with state_size(), save(double*) and
/// restore(const double*) is part of snapshots; any other T makes the diagram refuse them, by name.
template <class T> class OutsideState {
  public:
    OutsideState(Block* owner, std::function<std::shared_ptr<T>()> make);
    int index() const { return index_; }

  private:
    int index_;
};

/// A resource offered to the enclosing subsystem. T is its immutable description; T::Live what T::open()
/// makes of it, once per running diagram. T::resource names it in messages.
template <class T> class Provides {
  public:
    Provides(Block* owner, std::function<std::shared_ptr<const T>()> make);
    int index() const { return index_; }

  private:
    int index_;
};

/// The nearest resource of that type around the block. The description is there from elaboration on.
template <class T> class Requires {
  public:
    /// present = false: the arguments make it unnecessary.
    explicit Requires(Block* owner, const char* doc = "", bool present = true);
    Requires(const Requires&) = delete;
    bool is_bound() const { return bound_ != nullptr; }
    const T& operator*() const { return *bound_; }
    const T* operator->() const { return bound_.get(); }
    int index() const { return index_; }

  private:
    std::shared_ptr<const T> bound_;
    int index_;
};

/// E& for scalars, Eigen::Map for the rest; const-ness follows the pointer.
template <class T, class Pointer> decltype(auto) view(Pointer data, const Size& size) {
    constexpr bool is_const = std::is_const_v<std::remove_pointer_t<Pointer>>;
    if constexpr (is_element<T>) {
        return (*data);
    } else {
        using Plain = typename std::conditional_t<
            std::is_same_v<T, Array<typename ElementOf<T>::type>>,
            std::type_identity<Eigen::Matrix<typename ElementOf<T>::type, -1, -1>>,
            std::type_identity<T>>::type;
        return Eigen::Map<std::conditional_t<is_const, const Plain, Plain>>(data, size.rows, size.cols);
    }
}

/// Read access to inputs, outputs already computed, parameters and states at this instant.
class Now {
  public:
    explicit Now(const Frame& frame) : frame_(&frame) {}

    template <class T, Role role> decltype(auto) operator[](const Key<T, role>& key) const {
        static_assert(type_symbol<T> < 0, "the element type of this key is decided by wiring: use a rule");
        return view<T>(static_cast<const typename ElementOf<T>::type*>(frame_->now[key.index()]),
                       frame_->sizes[key.index()]);
    }
    template <class T> T& operator[](const Scratch<T>& key) const {
        return *static_cast<T*>(frame_->objects[key.index()]);
    }
    template <class T> T& operator[](const OutsideState<T>& key) const {
        return *static_cast<T*>(frame_->objects[key.index()]);
    }
    template <class T> typename T::Live& operator[](const Provides<T>& key) const {
        return *static_cast<typename T::Live*>(frame_->objects[key.index()]);
    }
    template <class T> typename T::Live& operator[](const Requires<T>& key) const {
        return *static_cast<typename T::Live*>(frame_->objects[key.index()]);
    }
    /// Is an optional input wired?
    template <class T> bool is_connected(const Input<T>& key) const { return frame_->connected[key.index()]; }
    double time() const { return frame_->clock->time; }
    double period() const { return frame_->clock->period; }
    std::int64_t step() const { return frame_->clock->step; }

  private:
    const Frame* frame_;
};

/// Write access to the keys of one role.
template <Role... roles> class Writer {
  public:
    explicit Writer(const Frame& frame, void* const* target) : frame_(&frame), target_(target) {}

    template <class T, Role role>
    requires((role == roles) || ...) decltype(auto) operator[](const Key<T, role>& key) const {
        static_assert(type_symbol<T> < 0, "the element type of this key is decided by wiring: use a rule");
        return view<T>(static_cast<typename ElementOf<T>::type*>(target_[key.index()]),
                       frame_->sizes[key.index()]);
    }

  private:
    const Frame* frame_;
    void* const* target_;
};

struct Out : Writer<Role::output> {
    explicit Out(const Frame& f) : Writer(f, f.now) {}
};
/// The next discrete state.
struct Next : Writer<Role::discrete_state> {
    explicit Next(const Frame& f) : Writer(f, f.next) {}
};
/// The time derivative of the continuous state.
struct Rate : Writer<Role::continuous_state> {
    explicit Rate(const Frame& f) : Writer(f, f.rate) {}
};
/// The values of the zero-crossing functions.
struct Guards : Writer<Role::guard> {
    explicit Guards(const Frame& f) : Writer(f, f.now) {}
};
/// The state right after an event, discrete and continuous; starts as the state before it.
struct After : Writer<Role::discrete_state, Role::continuous_state> {
    explicit After(const Frame& f) : Writer(f, f.next) {}
};

} // namespace bf
