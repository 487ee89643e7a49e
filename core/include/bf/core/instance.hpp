// One block that runs by itself, without a diagram: for hosts that call blocks one at a time.
#pragma once

#include "bf/core/context.hpp"
#include "bf/core/registry.hpp"
#include "bf/core/resolve.hpp"

#include <array>
#include <functional>
#include <memory>
#include <vector>

namespace bf {

/// A block, what is decided about it, and its data. It is made, told values, resources and wiring, settled,
/// and then opened; only an open one can step. All errors before a step are exceptions derived from
/// std::runtime_error whose text names the quantity.
class Instance {
  public:
    /// Throws what is wrong with the arguments.
    Instance(const BlockClass& type, const Arguments& arguments);
    ~Instance();
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;

    const BlockClass& type() const { return type_; }
    Block& block() { return *block_; }
    const Block& block() const { return *block_; }
    const Declaration& declaration() const { return block_->declaration(); }
    const Resolution& resolution() const { return block_->resolution(); }
    const Slot& slot(int i) const { return resolution().slots[static_cast<std::size_t>(i)]; }

    /// The value of a parameter.
    void give(int parameter, const Value& value);
    /// A resource that the block requires, and who opens its live object.
    void require(int requirement, std::shared_ptr<const void> resource, std::function<Object()> open);
    /// The live object behind what the block provides is one that others have, too.
    void share(int provision, std::shared_ptr<const void> resource, std::function<Object()> open);
    /// What is wired to a quantity, a Size or a Type, and what follows from it.
    template <class News> void wire(int slot, const News& news) {
        offer(block_->resolution(), slot, news);
        propagate(*block_);
    }
    /// Decides what is still open (resolve.hpp).
    void settle();
    /// Whether an optional input is wired; none: no one is.
    using Connects = std::function<bool(int)>;
    /// Throws where a size is unknown, or a value has another number of elements.
    void require_resolved(const Connects& connects = {}) const;

    /// Allocates everything and opens the resources.
    void open(const Connects& connects = {});
    bool is_open() const { return context_ != nullptr; }

    void start(); ///< opens what the block needs outside, which the destructor closes
    Status reset() { return context_->initialize(0); } ///< initial states
    Status run(Phase phase); ///< all activities of a phase; the first failure ends it
    Status event() { return context_->event(0, tasks_[static_cast<std::size_t>(Phase::event)]); }
    void commit() { context_->commit(0); }

    Clock& clock() { return context_->clock(0); }
    void* data(int slot) { return context_->data(0, slot); }
    const void* data(int slot) const { return std::as_const(*context_).data(0, slot); }
    double* rate(int state) { return static_cast<double*>(context_->frame(0).rate[state]); }
    std::size_t bytes_of(int slot) const;
    /// The live object behind what the block provides; it lives as long as this instance.
    Object object(int provision) const;
    Context& context() { return *context_; }

  private:
    bool is_connected(int slot, const Connects& connects) const;

    const BlockClass& type_;
    std::unique_ptr<Block> block_;
    std::vector<std::function<Object()>> borrowed_, shared_;
    std::unique_ptr<Context> context_;
    std::array<std::vector<Task>, phases.size()> tasks_; // by phase
    bool has_started_ = false;
};

} // namespace bf
