// Blocks that a generated program makes through the factory, as the class of the model sees them.
#pragma once

#include <cstddef>

namespace bf::generated {

class Hosted {
  public:
    virtual ~Hosted() = default;
    /// What was started stops; clocks and memory of its own are as before the first step.
    virtual void prepare() noexcept = 0;
    /// Blocks start: devices open. What was started is stopped when one fails.
    virtual bool start() noexcept = 0;
    /// Blocks stop, last started first.
    virtual void stop() noexcept = 0;
    /// A method or rule of a block.
    virtual bool run(int task) noexcept = 0;
    /// States of one block have their declared initial values, then the block changes them.
    virtual void set_states(int block) noexcept = 0;
    virtual bool reset(int block) noexcept = 0;
    /// The block's answer to its zero crossings.
    virtual bool event(int block) noexcept = 0;
    /// The rate is hit at that time, or the solver goes to it inside a step.
    virtual void hit(int rate, double time) noexcept = 0;
    virtual void go_to(int rate, double time) noexcept = 0;
    /// A quantity has its initial value, where that is known at the start: one of the program's `sets`.
    virtual void set(int /*number*/) noexcept {}
    /// A triggered subsystem of that rate runs; its period is the time since it ran before.
    virtual void fire(int rate, double time) noexcept = 0;
    /// What the blocks hold besides the memory of the model's class: its size in bytes, -1 where some of it
    /// cannot be saved.
    virtual std::ptrdiff_t snapshot_size() const noexcept { return -1; }
    virtual void save(unsigned char* /*to*/) const noexcept {}
    virtual void restore(const unsigned char* /*from*/) noexcept {}
    /// Why the last call failed, and which block when the call did not name it.
    virtual const char* failure() const noexcept = 0;
    virtual const char* failed_block() const noexcept = 0;
};

} // namespace bf::generated
