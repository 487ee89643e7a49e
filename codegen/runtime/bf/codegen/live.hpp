// The live server of a generated program: signals, parameters and timing for viewers, by the same protocol as
// `bf run --realtime --serve`. It is the installed BlockFactory's; a project that is configured without LIVE
// has none.
#pragma once

#include "bf/realtime/control.hpp"
#include "bf/realtime/statistics.hpp"

#include <cstdint>
#include <string>

#ifdef BF_LIVE
#include "bf/realtime/server.hpp"
#include "bf/realtime/token.hpp"
#include "bf/run/loaded.hpp"

#include <optional>

extern "C" const bf_run_library* bf_run_v1(void);
#endif

namespace bf::generated {

struct LiveOptions {
    std::string where, token; ///< token: file
    bool is_controlled = false;
};

#ifdef BF_LIVE

/// Looks at the model that the program's loop steps.
class Live {
  public:
    template <class Model>
    Live(Model& model, realtime::Control& control, const realtime::Statistics& statistics)
        : run_(*bf_run_v1(), reinterpret_cast<bf_run_model&>(model)), access_{parameters_, control,
                                                                              statistics} {}

    /// Empty, or what is wrong.
    std::string listen(const LiveOptions& options) {
        realtime::ServerOptions served;
        served.where = options.where;
        served.is_controlled = options.is_controlled;
        served.why_not_edited = "this program is generated code, so edits change the file alone; generate "
                                "and build it anew, or run the model with bf run --editable";
        if (!options.token.empty())
            if (const std::string wrong = realtime::read_token(options.token, served.token); !wrong.empty())
                return wrong;
        try {
            server_.emplace(run_, run_.signals(), access_, served);
        } catch (const std::exception& error) {
            return error.what();
        }
        place_ = server_->address() +
                 (options.token.empty() ? server_->token() : "..., the line in " + options.token);
        return "";
    }
    const std::string& place() const { return place_; } ///< for people

    // The loop: before a step (-1: before the start), after its outputs, at an event.
    void apply(std::int64_t step) noexcept { parameters_.apply(run_, step); }
    void observe() noexcept { server_->observe(run_); }
    void observe_event() noexcept { run_.show_event(*server_); }

    /// Tells viewers; see bf::realtime::Server.
    void end(const std::string& failure, bool is_interrupted) { server_->end(failure, is_interrupted); }
    std::string log() const { return realtime::log_text(server_->log()); }
    std::string emergency() const { return realtime::emergency_in(server_->log()); }

  private:
    LoadedRun run_;
    realtime::ParameterMailbox parameters_;
    const realtime::LoopAccess access_;
    std::optional<realtime::Server> server_;
    std::string place_;
};

#else

class Live {
  public:
    template <class Model> Live(Model&, realtime::Control&, const realtime::Statistics&) {}
    std::string listen(const LiveOptions&) {
        return "this program was built without the live server; configure its project with -DLIVE=ON and "
               "CMAKE_PREFIX_PATH, the installed BlockFactory (a project with sizes found at the start has "
               "none)";
    }
    const std::string& place() const { return none_; }
    void apply(std::int64_t) noexcept {}
    void observe() noexcept {}
    void observe_event() noexcept {}
    void end(const std::string&, bool) {}
    const std::string& log() const { return none_; }
    const std::string& emergency() const { return none_; }

  private:
    const std::string none_;
};

#endif

} // namespace bf::generated
