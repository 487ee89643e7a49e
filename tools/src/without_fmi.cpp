#include "session.hpp"
#include "ssp.hpp"
#include "verbs.hpp"

namespace bf::tools {

namespace {

constexpr const char* missing = "bf was built without FMUs; build it with BF_FMI=ON";

void add_missing(CLI::App& app, const char* verb, const std::string& what) {
    app.add_subcommand(verb, what + ": not in this build")->allow_extras()->callback([] {
        throw CommandError(missing);
    });
}

} // namespace

void add_export_fmu(CLI::App& app) { add_missing(app, "export-fmu", "write a model as an FMU"); }
void add_export_ssp(CLI::App& app) {
    add_missing(app, "export-ssp", "write a model of FMUs as a system of them");
}
void add_check_fmu(CLI::App& app) { add_missing(app, "check-fmu", "find out what is wrong with an FMU"); }
model::Model open_system(const std::filesystem::path&, const std::vector<Override>&) {
    throw CommandError(missing);
}
std::map<std::string, std::filesystem::path> fmus_of(const Diagram&) { return {}; }

} // namespace bf::tools
