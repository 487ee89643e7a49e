#pragma once

#include "bf/core/registry.hpp"

namespace bf::toolbox {

/// Control in task space: tasks and constraints as matrices of rows, and what solves them.
void add_tasks(Library& library);
void add_task_solvers(Library& library);

} // namespace bf::toolbox
