// What blocks of FMUs share: how an FMU is found, its variables as quantities, and its values on their way.
#pragma once

#include "bf/core/context.hpp"
#include "bf/core/registry.hpp"
#include "bf/fmi/clockwork.hpp"
#include "bf/fmi/instance.hpp"

#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace bf::fmi {

/// A variable as a quantity of the block.
struct Port {
    int variable; ///< its number
    int slot;
    bool is_continuous, is_tunable; ///< of its variability
    std::vector<int> clocks;        ///< in whose ticks alone it has values; none: always
    bool is_early = false;          ///< of inputs: does an output wait for it?
    std::function<void*(Now)> memory;
};
using Ports = std::vector<Port>;

/// Values on their way between the block's memory and an instance.
class Transfer {
  public:
    /// Of those ports that are wanted.
    Transfer(const Description& d, const Ports& ports, const std::function<bool(const Port&)>& is_wanted);
    bool write_to(Instance& instance, Now at) noexcept;
    bool read_from(Instance& instance, Now at) noexcept;
    /// Is any value another one than was written last?
    bool differs(Now at) const noexcept;

  private:
    struct Item {
        std::size_t group, first;
        const Port* port;
        bf::Type type;
        int rows, cols;
        std::size_t written; ///< where its bytes begin among those that were written last
    };
    static std::size_t size(const Item& item) {
        return static_cast<std::size_t>(item.rows * item.cols * bytes(item.type));
    }
    static int place(const Item& item, int i) { return column_by_column(i, item.rows, item.cols); }

    std::vector<Values> values_;
    std::vector<Item> items_;
    /// As the block's memory has them: bits are compared, since NaN differs from itself, and 0 from -0 does
    /// not.
    std::vector<std::byte> written_;
};

/// The running FMU of one context, part of snapshots where the FMU can save itself.
class Running {
  public:
    /// `timeout`: s that a call may take in a process of the FMU's own; 0: it has none.
    Running(std::filesystem::path archive, const Description& d, Kind kind, Structure structure,
            double timeout);

    bool can_save() const { return can_save_; }
    std::size_t state_size(); ///< throws std::runtime_error where the FMU does not give its state
    void save(double* to) const;
    void restore(const double* from);

    /// Makes an instance, a new one where there was one. Throws FmuError.
    void open();
    void close() noexcept;
    /// Of what the instance failed at; the text stays when it is closed.
    Status failure() noexcept { return failure(instance->failure()); }
    Status failure(const char* text) noexcept;

  private:
    std::filesystem::path archive_;
    Description description_; ///< which is read once, when the block is made
    Kind kind_;
    Structure structure_;
    double timeout_;
    std::unique_ptr<Library> library_; // outlives the instance
    bool can_save_;
    std::vector<std::uint8_t> bytes_;
    char message_[700] = "";

  public:
    std::unique_ptr<Instance> instance;
    bool is_restored = true;
    /// What a block remembers of its instance, as numbers that go into snapshots.
    struct Memory {
        double is_initialized = 0;
        double step = -1;                                            ///< the last one that was begun
        double next_event = std::numeric_limits<double>::infinity(); ///< s
        double sign = 1; ///< of the guard of events that are no crossings
        double ticked = -std::numeric_limits<double>::infinity(); ///< s, when clocks did last
    } memory;
    std::vector<Transfer> transfers; ///< numbered by each kind of block, of what has no clock
    /// What has values in the ticks of some clocks alone.
    struct Clocked {
        std::vector<int> clocks;
        Transfer early, late, outputs;
    };
    std::vector<Clocked> clocked;
    Clockwork clockwork;

    /// Within which two times are one.
    static double slack(Now at) noexcept;
    bool is_tick(Now at) const noexcept { return clockwork.is_due(memory.ticked, at.time()); }
    /// Did some tick before this step?
    bool has_missed_tick(Now at) const noexcept { return clockwork.is_late(memory.ticked, at.time()); }
    /// In Event Mode: activates the clocks that tick now.
    bool tick(Now at) noexcept { return !is_tick(at) || clockwork.tick(*instance, memory.ticked, at.time()); }
    /// Of active clocks, early inputs or late ones.
    bool write_clocked(Now at, Transfer Clocked::*which) noexcept;
    bool read_clocked(Now at) noexcept;
    /// Updates discrete states until nothing more changes; then no clock is active.
    bool end_event(Now at, Event& event) noexcept;
    std::vector<double> row; ///< for states
};

/// An FMU of one kind. Ports, parameters, types and sizes are those of its description.
class FmuBlock : public Block {
  public:
    FmuBlock(const Arguments& arguments, Kind kind);
    bool feedthrough(int output, int input) const override;
    void stop(Now at) const noexcept override { at[running_].close(); }

    bf::Argument<std::string> fmu{
        this, "fmu", {.doc = "file of the FMU, in a folder that plugins are taken from (--plugin-path)"}};

    bf::Argument<std::vector<std::string>> structure{
        this,
        "structure",
        {.doc = "values of structural parameters, which decide the sizes of ports: [n=3, m=2]"}};
    bf::Argument<std::string> process{this,
                                      "process",
                                      {.initial = "shared",
                                       .doc = "where the FMU runs: in the process of the run, or in one of "
                                              "its own, so that its crash is a message",
                                       .choices = {"shared", "own"}}};
    bf::Argument<double> timeout{
        this,
        "timeout",
        {.initial = 60,
         .above = 0,
         .doc = "how long one of its functions may take in a process of its own [s]"}};

  protected:
    /// Those of clocked ports, by their clocks.
    std::vector<Running::Clocked> clocked() const;

    Description description_;
    Ports inputs_, outputs_, parameters_;

  private:
    bool depends(int output, int input) const;
    void declare_ports(Kind kind);
    Structure structure_of_arguments() const; ///< throws FmuError
    template <Role role> Port declare(int number, const Variable& v, const std::string& name);

    std::filesystem::path archive_;

  protected:
    OutsideState<Running> running_;
};

void add_co_simulation(bf::Library& library);
void add_model_exchange(bf::Library& library);

} // namespace bf::fmi
