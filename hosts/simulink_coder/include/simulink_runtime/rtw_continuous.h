/* Continuous parts of a generated model: types only. */
#ifndef BLOCKFACTORY_RTW_CONTINUOUS_H
#define BLOCKFACTORY_RTW_CONTINUOUS_H

#include "rtw_solver.h"

typedef enum { SOLVER_MODE_AUTO, SOLVER_MODE_SINGLETASKING, SOLVER_MODE_MULTITASKING } SolverMode;

#endif
