// FMUs that run here: the library out of an archive, and its instances, alike for both versions of the
// standard.
#pragma once

#include "bf/fmi/archive.hpp"
#include "bf/fmi/call_order.hpp"
#include "bf/fmi/description.hpp"
#include "bf/fmi/under_way.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace bf::fmi {

/// How an FMU is run: it does steps by itself, or our solver integrates its states.
enum class Kind { co_simulation, model_exchange };

/// An FMU's files in a folder of their own and its library, opened. It is a program: opening it runs its
/// code.
class Library {
  public:
    /// Extracts and opens it. Throws FmuError, also where it is not of that kind, has none for this machine
    /// or lacks functions that every importer needs.
    /// `description`: what description_of() gave for that structure.
    Library(const std::filesystem::path& archive, Description description, Kind kind, Structure structure);
    explicit Library(const std::filesystem::path& archive, Kind kind = Kind::co_simulation,
                     const Structure& structure = {});
    ~Library();
    Library(const Library&) = delete;
    Library& operator=(const Library&) = delete;

    Kind kind() const { return kind_; }
    const Description& description() const { return description_; }
    /// What it offers of its kind.
    const std::optional<Interface>& interface() const {
        return kind_ == Kind::co_simulation ? description_.co_simulation : description_.model_exchange;
    }
    const std::filesystem::path& archive() const { return archive_; }
    std::filesystem::path resources() const { return folder_.path() / "resources"; }
    /// For messages of one that cannot run: that it needs another program, where it says so.
    std::string without_tool() const;
    /// The functions of the standard that it lacks.
    std::vector<std::string> missing() const;
    struct Functions; ///< those that are called
    /// Did opening it change how the process computes (rounding, subnormal numbers)? It is put back.
    bool changes_arithmetic() const { return changes_arithmetic_; }

  private:
    friend class LocalInstance;
    std::filesystem::path archive_;
    Kind kind_;
    Structure structure_;
    Description description_;
    TemporaryFolder folder_;
    void* handle_ = nullptr;
    bool changes_arithmetic_ = false;
    std::unique_ptr<Functions> functions_;
};

/// Values of variables of one type, one behind the other, which go to an instance and come from it in one
/// call.
class Values {
  public:
    /// Values of `type` in that version of the standard.
    Values(int version, Type type) : version_(version), type_(type) {}
    /// The place of the variable's first element.
    std::size_t add(const Variable& variable);
    Type type() const { return type_; }
    std::size_t size() const { return count_; }
    bool is_empty() const { return references_.empty(); }
    double operator[](std::size_t i) const;
    void set(std::size_t i, double x);
    const std::vector<std::uint32_t>& references() const { return references_; }

    /// The values as they lie in memory.
    void* data();
    const void* data() const { return const_cast<Values*>(this)->data(); }
    std::size_t bytes() const;

  private:
    friend class LocalInstance;
    int version_;
    Type type_;
    std::size_t count_ = 0;
    std::vector<std::uint32_t> references_;
    std::vector<double> doubles_;        ///< of Float64 and Real
    std::vector<std::int32_t> integers_; ///< of FMI 2.0: Integer, Boolean, Enumeration
    std::vector<unsigned char> bytes_;   ///< of all else
};
/// Is it a type that Values holds?
bool has_values(Type type);

/// What the variables are called as ports and parameters of a block: "controller.K[1,2]" is
/// "controller_K_1_2". Empty for those that are none: parameters without a start value, locals, texts.
std::vector<std::string> block_names(const Description& description, Kind kind);

/// What an event changed.
struct Event {
    bool has_jumped = false;                               ///< did continuous states?
    double next = std::numeric_limits<double>::infinity(); ///< s, of the next event that is known before
};

/// A running FMU. Functions give false when they failed; `failure()` says why.
class Instance {
  public:
    /// Gets what the FMU logs: the number of the standard's status, a category, the text.
    using Log = std::function<void(int, const std::string&, const std::string&)>;
    virtual ~Instance() = default;
    Instance(const Instance&) = delete;
    Instance& operator=(const Instance&) = delete;

    virtual bool enter_initialization(double start) noexcept = 0;
    virtual bool exit_initialization() noexcept = 0;
    virtual bool get(Values& values) noexcept = 0;
    virtual bool set(const Values& values) noexcept = 0;
    /// Of co-simulation. False also when the FMU asks to end the simulation, or does less than the whole
    /// step.
    virtual bool do_step(double time, double step) noexcept = 0;
    virtual bool terminate() noexcept = 0;
    virtual bool reset() noexcept = 0;

    // Of model exchange. Rows have as many numbers as there are states or event indicators.
    int state_count() const { return state_count_; }
    int indicator_count() const { return indicator_count_; }
    virtual bool set_time(double time) noexcept = 0;
    virtual bool set_states(const double* x) noexcept = 0;
    virtual bool get_states(double* x) noexcept = 0;
    /// False also for one that is not finite.
    virtual bool get_derivatives(double* rates) noexcept = 0;
    virtual bool get_indicators(double* z) noexcept = 0;
    /// A step of the solver ended; does the FMU ask for an event?
    virtual bool complete_step(bool& wants_event) noexcept = 0;
    virtual bool enter_event_mode() noexcept = 0;
    /// Updates discrete states until nothing more changes; false also where that has no end.
    virtual bool handle_event(Event& event) noexcept = 0;
    virtual bool enter_continuous_time() noexcept = 0;

    // Of clocks, by their references. An FMU that has some is in Event Mode at the begin of co-simulation,
    // too, and leaves it for steps.
    virtual bool enter_step_mode() noexcept = 0;
    virtual bool activate(const std::vector<std::uint32_t>& clocks) noexcept = 0;
    /// s, of a clock whose description does not say them.
    virtual bool get_interval(std::uint32_t clock, double& interval, double& shift) noexcept = 0;

    /// How much `change` changes along the direction that `along` holds, at this instant; both are of
    /// Float64 or Real. It is no part of a step. Where the FMU has no derivatives it must not be called.
    virtual bool differentiate(const Values& along, Values& change) noexcept = 0;

    /// The state as bytes, with which an instance of the same FMU goes on.
    virtual bool save(std::vector<std::uint8_t>& bytes) noexcept = 0;
    /// `state`: in which mode they were saved.
    virtual bool restore(const std::vector<std::uint8_t>& bytes, State state) noexcept = 0;

    virtual State state() const noexcept = 0;
    /// "controller.fmu: fmi3DoStep failed: ...", until the next failure.
    const char* failure() const noexcept { return failure_; }
    /// What the caller finds wrong with what a function gave; false.
    bool fail(const char* function, const char* why) noexcept;
    /// A name that depends on the version of the standard.
    const char* of_version(const char* of_2, const char* of_3) const noexcept {
        return version_ == 2 ? of_2 : of_3;
    }

  protected:
    Instance(std::string file, int version) : file_(std::move(file)), version_(version) {}

    std::string file_; ///< for messages
    int version_, state_count_ = 0, indicator_count_ = 0;
    char failure_[700] = "";
};

/// One in this process. Each call is checked against the order of calls first, so that a mistake of the
/// caller is a message, too.
class LocalInstance final : public Instance {
  public:
    /// Throws FmuError when the FMU makes none. The library lives longer. `doing`, where it is given, has the
    /// name of the function that is being called.
    LocalInstance(const Library& library, const std::string& name, Log log = {}, char* doing = nullptr);
    ~LocalInstance() override;

    bool enter_initialization(double start) noexcept override;
    bool exit_initialization() noexcept override;
    bool get(Values& values) noexcept override;
    bool set(const Values& values) noexcept override;
    bool do_step(double time, double step) noexcept override;
    bool terminate() noexcept override;
    bool reset() noexcept override;
    bool set_time(double time) noexcept override;
    bool set_states(const double* x) noexcept override;
    bool get_states(double* x) noexcept override;
    bool get_derivatives(double* rates) noexcept override;
    bool get_indicators(double* z) noexcept override;
    bool complete_step(bool& wants_event) noexcept override;
    bool enter_event_mode() noexcept override;
    bool handle_event(Event& event) noexcept override;
    bool enter_continuous_time() noexcept override;
    bool enter_step_mode() noexcept override;
    bool activate(const std::vector<std::uint32_t>& clocks) noexcept override;
    bool get_interval(std::uint32_t clock, double& interval, double& shift) noexcept override;
    bool differentiate(const Values& along, Values& change) noexcept override;
    bool save(std::vector<std::uint8_t>& bytes) noexcept override;
    bool restore(const std::vector<std::uint8_t>& bytes, State state) noexcept override;
    State state() const noexcept override { return order_.state(); }
    /// The first function that left another rounding mode, or subnormal numbers flushed to zero, which was
    /// put back; nullptr: none.
    const char* changed_arithmetic() const noexcept { return changed_arithmetic_; }
    static constexpr std::size_t longest_name = 100; ///< of a function, in `doing`

  private:
    bool may(Call call, const char* function) noexcept;
    /// Calls f, where it may be, which gives a status.
    template <class F> bool called(Call call, const char* function, F&& f) noexcept {
        return may(call, function) && done(call, function, static_cast<int>(f()));
    }
    /// Before a function is called, and after it.
    void note(const char* function) noexcept;
    void returned(const char* function) noexcept;
    void free_state(void* state) noexcept;
    bool resize(std::vector<std::uint8_t>& bytes, std::size_t size) noexcept;
    bool done(Call call, const char* function, int status) noexcept;
    bool configure() noexcept;
    void count_states();
    template <class F> bool get_row(Call call, const char* function, double* to, int count, F&& f) noexcept;
    static void log_3(void* self, int status, const char* category, const char* text);
    static void log_2(void* self, const char* name, int status, const char* category, const char* format,
                      ...);
    void log(int status, const char* category, const char* text) noexcept;

    const Library& library_;
    const Library::Functions& f_;
    CallOrder order_;
    std::string name_, token_;
    Log log_;
    char* doing_;
    struct Callbacks;
    std::unique_ptr<Callbacks> callbacks_;
    void* instance_ = nullptr;
    std::vector<double> row_; ///< with one number more, by which is found what writes too many
    char logged_[400] = "";
    UnderWay under_way_;
    unsigned arithmetic_; ///< modes of the process, which calls leave as they are
    const char* changed_arithmetic_ = nullptr;
};

/// One in a process of its own, which brings its library along. A crash and a call that does not return
/// within `timeout` s are failures. Throws FmuError.
std::unique_ptr<Instance> make_remote_instance(const std::filesystem::path& archive,
                                               const Description& description, Kind kind,
                                               const std::string& name, double timeout, Instance::Log log,
                                               const Structure& structure = {});

} // namespace bf::fmi
