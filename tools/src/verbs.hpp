// The verbs of `bf`. Each adds its subcommand; its callback does the work and throws on failure.
#pragma once

#include <CLI/CLI.hpp>

namespace bf::tools {

void add_run(CLI::App& app);
void add_replay(CLI::App& app);
void add_sweep(CLI::App& app);
void add_check(CLI::App& app);
void add_describe(CLI::App& app);
void add_plot(CLI::App& app);
void add_film(CLI::App& app);
void add_export(CLI::App& app);
void add_generate(CLI::App& app);
void add_export_fmu(CLI::App& app);
void add_export_ssp(CLI::App& app);
void add_check_fmu(CLI::App& app);
void add_deploy(CLI::App& app);
void add_draw(CLI::App& app);
void add_diff(CLI::App& app);
void add_linearize(CLI::App& app);
void add_responses(CLI::App& app); ///< bode, nyquist, nichols, rootlocus, step
void add_frequency_response(CLI::App& app);
void add_trim(CLI::App& app);
void add_gradient(CLI::App& app);
void add_sensitivity(CLI::App& app);
void add_edit(CLI::App& app);
void add_view(CLI::App& app);
void add_publish(CLI::App& app);
void add_serve(CLI::App& app);
void add_tune(CLI::App& app);
void add_doctor(CLI::App& app);

} // namespace bf::tools
