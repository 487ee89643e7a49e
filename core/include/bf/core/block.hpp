// The block: a rule with inputs, outputs, parameters and states that knows nothing of engines.
#pragma once

#include "bf/core/access.hpp"
#include "bf/core/resolution.hpp"
#include "bf/core/rule.hpp"
#include "bf/core/status.hpp"

#include <concepts>

namespace bf {

namespace detail {
/// The declaration of a block that is being made.
Declaration& declared_by(Block& owner);
} // namespace detail

/// What a block may ask and say while sizes and types are inferred.
class Inference {
  public:
    explicit Inference(Resolution& resolution) : resolution_(&resolution) {}

    /// The size of the key's slot, or null while it is unknown.
    template <class T, Role role> const Size* size(const Key<T, role>& key) const {
        return size(key.index());
    }
    template <class T, Role role> void set(const Key<T, role>& key, Size size) { set(key.index(), size); }
    template <class T, Role role> const Type* type(const Key<T, role>& key) const {
        return type(key.index());
    }
    template <class T, Role role> void set(const Key<T, role>& key, Type type) { set(key.index(), type); }

    const Size* size(int slot) const;
    const Type* type(int slot) const;
    void set(int slot, Size size);
    void set(int slot, Type type);
    /// Elements keep their names from one vector to another, where no common shape says so already.
    void same_elements(SameElements elements);
    /// The block sets something outside. Elaboration refuses a second block that sets the same, unless each
    /// stands in a conditional subsystem of its own.
    void claim(Claim claim);
    /// A wiring that the block cannot accept, in words that name the ports.
    [[noreturn]] void refuse(const std::string& message) const;

  private:
    Resolution* resolution_;
};

/// A pure rule: declares its quantities once, then maps (inputs, states, parameters) to (outputs, next
/// states). It holds no signal data, so one instance may serve many running diagrams.
///
/// A block is either rules (OutputRule, UpdateRule, ... members) or the methods below. All methods of a step
/// are const and noexcept, allocate nothing and lock nothing.
class Block {
  public:
    explicit Block(const Arguments& arguments = no_arguments());
    Block(const Block&) = delete;
    Block& operator=(const Block&) = delete;
    virtual ~Block();

    /// Decides sizes and types that symbols alone cannot: called until nothing new is learned.
    virtual void infer(Inference&) const {}
    /// Does this output depend on this input in the same step? Both are slot indices.
    virtual bool feedthrough(int output, int input) const;
    /// Must this input be connected? Asked when the resources are bound; otherwise an open one reads
    /// `initial`.
    virtual bool needs(int input) const;

    /// Opens what the block needs outside; may throw with the reason and the remedy.
    virtual void start(Now) const {}
    /// Initial states, after the declared ones were set. Runs at the start and when a subsystem resets.
    virtual Status reset(Now, After) const noexcept { return ok; }
    virtual Status output(Now, Out) const noexcept { return ok; }
    virtual Status update(Now, Next) const noexcept { return ok; }
    virtual Status derivative(Now, Rate) const noexcept { return ok; }
    virtual Status guards(Now, Guards) const noexcept { return ok; }
    virtual Status event(Now, After) const noexcept { return ok; }
    /// Closes what start opened and puts actuators back.
    virtual void stop(Now) const noexcept {}

    /// Which of the methods above this class overrides; the engine calls no other. Filled by the registry.
    struct Methods {
        bool reset = false, output = false, update = false, derivative = false, guards = false, event = false;
        bool start = false; ///< or stop
    };

    /// Does the block change its states where its guards cross zero?
    bool answers(const Methods& methods) const { return methods.event || !declaration_.event_rules.empty(); }

    const Declaration& declaration() const { return declaration_; }
    /// What the diagram around it has decided so far; nothing at first.
    const Resolution& resolution() const;
    Resolution& resolution();

  protected:
    /// Asks engines for what rules and methods cannot say.
    void declare(const Traits& traits) { declaration_.traits = traits; }

    /// Refuses the arguments; text = what is wrong, which value, the remedy.
    void problem(std::string text) { declaration_.problems.push_back(std::move(text)); }

    /// A file name given as argument, relative to the model's folder unless absolute.
    std::string path_of(const std::string& file) const;

    /// The resolved size and type of a key; only for rules of Dim, Scratch and OutsideState.
    template <class T, Role role> const Size& size(const Key<T, role>& key) const {
        return resolution().slots[static_cast<std::size_t>(key.index())].size;
    }
    int value(const Dim& dim) const { return resolution().dims[static_cast<std::size_t>(dim.id())]; }

  private:
    template <class> friend class Argument;
    friend Declaration& detail::declared_by(Block& owner);
    static const Arguments& no_arguments();
    const Arguments* arguments_; // valid while the block is being made
    const std::string folder_;   // of the model
    Declaration declaration_;
    mutable std::unique_ptr<Resolution>
        resolution_; // begun when the first asks, as the declaration is complete then
};

/// Which methods a block class overrides.
template <class B> constexpr Block::Methods methods_of() {
    return {.reset = !std::same_as<decltype(&B::reset), decltype(&Block::reset)>,
            .output = !std::same_as<decltype(&B::output), decltype(&Block::output)>,
            .update = !std::same_as<decltype(&B::update), decltype(&Block::update)>,
            .derivative = !std::same_as<decltype(&B::derivative), decltype(&Block::derivative)>,
            .guards = !std::same_as<decltype(&B::guards), decltype(&Block::guards)>,
            .event = !std::same_as<decltype(&B::event), decltype(&Block::event)>,
            .start = !std::same_as<decltype(&B::start), decltype(&Block::start)> ||
                     !std::same_as<decltype(&B::stop), decltype(&Block::stop)>};
}

/// Default, limits, documentation and allowed texts of an argument.
template <class T> struct AboutArgument {
    T initial = {};
    double minimum = -Limits::infinity; ///< of every number, inclusive
    double above = -Limits::infinity;   ///< every number is greater than this
    double maximum = Limits::infinity;  ///< of every number, inclusive
    const char* doc = "";
    std::vector<std::string> choices = {};
    bool from_path = false; ///< the default is a whole number that the block's path in the model decides
    bool is_secret = false; ///< it names the file of a secret, which no package holds
};

/// A value fixed when the block is made. It is there when later members are initialised, so it may decide
/// which ports exist: InputList<> u{this, "u", inputs}.
/// T: double, int, bool, std::string, Matrix, std::vector<double>, std::vector<int>,
/// std::vector<std::string>; Value takes anything and leaves the choice to the block.
template <class T> class Argument {
  public:
    Argument(Block* owner, const char* name, AboutArgument<T> about);
    operator const T&() const { return value_; }
    const T& operator*() const { return value_; }
    const T* operator->() const { return &value_; }

  private:
    T value_;
};

extern template class Argument<double>;
extern template class Argument<int>;
extern template class Argument<bool>;
extern template class Argument<std::string>;
extern template class Argument<Matrix>;
extern template class Argument<std::vector<double>>;
extern template class Argument<std::vector<int>>;
extern template class Argument<std::vector<std::string>>;
extern template class Argument<Value>;

// ---- implementation

namespace detail {

/// Appends a slot; returns its index, -1 when the port is absent.
int declare(Block& owner, Role role, std::string name, const About& about, Shape shape, Type type,
            int symbol);
int declare(Block& owner, ObjectDeclaration object);

/// The shape that a C++ type fixes; keys of any type without a given shape get one of their own.
template <class T> Shape shape_of(Block& owner, const About& about) {
    if constexpr (type_symbol<T> >= 0 || std::is_same_v<T, Array<typename ElementOf<T>::type>>) {
        return about.shape.is_given ? about.shape : Shape(AnyShape(&owner));
    } else if constexpr (is_element<T>) {
        return {};
    } else {
        Shape shape = about.shape;
        if constexpr (T::RowsAtCompileTime > 0) shape.rows = T::RowsAtCompileTime;
        if constexpr (T::ColsAtCompileTime > 0) shape.cols = T::ColsAtCompileTime;
        shape.is_matrix = T::ColsAtCompileTime != 1;
        return shape;
    }
}

/// An object of a running diagram. A T that is only a cache says `static constexpr bool is_cache = true`; one
/// that cannot always be saved answers `can_save()`.
template <class T> Object outside_object(std::shared_ptr<T> pointer) {
    Object object{pointer, {}, {}, {}, true};
    if constexpr (requires { T::is_cache; }) {
        object.is_outside = false;
    } else if constexpr (requires(T & t, double* to, const double* from) {
                             t.state_size(), t.save(to), t.restore(from);
                         }) {
        T* raw = pointer.get();
        if constexpr (requires { raw->can_save(); })
            if (!raw->can_save()) return object;
        object.state_size = [raw] { return static_cast<std::size_t>(raw->state_size()); };
        object.save = [raw](double* to) { raw->save(to); };
        object.restore = [raw](const double* from) { raw->restore(from); };
    }
    return object;
}

} // namespace detail

template <class T, Role role>
Key<T, role>::Key(Block* owner, const char* name, const About& about)
    : Key(owner, std::string(name), about) {}

template <class T, Role role>
Key<T, role>::Key(Block* owner, const std::string& name, const About& about)
    : index_(detail::declare(*owner, role, name, about, detail::shape_of<T>(*owner, about),
                             type_of<typename ElementOf<T>::type>, type_symbol<T>)) {}

template <class T>
Scratch<T>::Scratch(Block* owner, std::function<T()> make)
    : index_(detail::declare(*owner, {[make] {
          return Object{std::make_shared<T>(make()), {}, {}, {}};
      }})) {}

template <class T>
OutsideState<T>::OutsideState(Block* owner, std::function<std::shared_ptr<T>()> make)
    : index_(detail::declare(*owner, {[make] { return detail::outside_object<T>(make()); }})) {}

template <class T> Provides<T>::Provides(Block* owner, std::function<std::shared_ptr<const T>()> make) {
    auto& declaration = detail::declared_by(*owner);
    ObjectDeclaration object;
    object.provision = static_cast<int>(declaration.provisions.size());
    declaration.provisions.push_back({T::resource, [make]() -> std::shared_ptr<const void> { return make(); },
                                      [](const void* made) {
                                          return detail::outside_object<typename T::Live>(
                                              static_cast<const T*>(made)->open());
                                      }});
    index_ = detail::declare(*owner, std::move(object));
}

template <class T> Requires<T>::Requires(Block* owner, const char* doc, bool present) : index_(-1) {
    if (!present) return;
    auto& declaration = detail::declared_by(*owner);
    ObjectDeclaration object;
    object.requirement = static_cast<int>(declaration.requirements.size());
    declaration.requirements.push_back({T::resource, doc, [this](std::shared_ptr<const void> made) {
                                            bound_ = std::static_pointer_cast<const T>(made);
                                        }});
    index_ = detail::declare(*owner, std::move(object));
}

} // namespace bf
