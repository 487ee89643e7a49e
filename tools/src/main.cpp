// The `bf` command.
#include "bf/model/location.hpp"
#include "verbs.hpp"

#include <cstdio>
#include <exception>

int main(int argc, char** argv) {
    using namespace bf::tools;
    CLI::App app{"BlockFactory: design, simulate and run robot controllers as block diagrams"};
    app.require_subcommand(1);
    app.footer("Example: bf run examples/icub_balancing/balancing.yaml --stop 5");
    for (const auto add : {add_run, add_check, add_describe, add_plot, add_film, add_export, add_doctor}) add(app);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    } catch (const bf::model::Errors& errors) {
        for (const auto& diagnostic : errors.diagnostics()) std::fprintf(stderr, "%s\n", diagnostic.text().c_str());
        std::fprintf(stderr, "%zu error%s\n", errors.diagnostics().size(), errors.diagnostics().size() == 1 ? "" : "s");
        return 1;
    } catch (const std::exception& error) {
        std::fprintf(stderr, "bf: %s\n", error.what());
        return 1;
    }
    return 0;
}
