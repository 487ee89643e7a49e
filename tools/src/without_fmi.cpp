#include "session.hpp"
#include "verbs.hpp"

namespace bf::tools {

namespace {

void add_missing(CLI::App& app, const char* verb, const std::string& what) {
    app.add_subcommand(verb, what + ": not in this build")->allow_extras()->callback([] {
        throw CommandError("bf was built without FMUs; build it with BF_FMI=ON");
    });
}

} // namespace

void add_export_fmu(CLI::App& app) { add_missing(app, "export-fmu", "write a model as an FMU"); }
void add_check_fmu(CLI::App& app) { add_missing(app, "check-fmu", "find out what is wrong with an FMU"); }

} // namespace bf::tools
