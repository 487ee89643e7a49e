/* The methods of an S-function; null for those that it has not. */
#ifndef BLOCKFACTORY_SIMSTRUCT_METHODS_H
#define BLOCKFACTORY_SIMSTRUCT_METHODS_H

#include "simstruc.h"

typedef struct {
    void (*initialize_sizes)(SimStruct*);
    void (*initialize_sample_times)(SimStruct*);
    void (*outputs)(SimStruct*, int_T);
    void (*terminate)(SimStruct*);
    void (*check_parameters)(SimStruct*);
    void (*process_parameters)(SimStruct*);
    void (*set_input_port_dimension_info)(SimStruct*, int_T, const DimsInfo_T*);
    void (*set_output_port_dimension_info)(SimStruct*, int_T, const DimsInfo_T*);
    void (*set_default_port_dimension_info)(SimStruct*);
    void (*set_input_port_data_type)(SimStruct*, int_T, DTypeId);
    void (*set_output_port_data_type)(SimStruct*, int_T, DTypeId);
    void (*set_default_port_data_types)(SimStruct*);
    void (*set_work_widths)(SimStruct*);
    void (*start)(SimStruct*);
    void (*initialize_conditions)(SimStruct*);
    void (*update)(SimStruct*, int_T);
    void (*derivatives)(SimStruct*);
    void (*zero_crossings)(SimStruct*);
    mxArray* (*get_sim_state)(SimStruct*);
    void (*set_sim_state)(SimStruct*, const mxArray*);
    void (*rtw)(SimStruct*);
} SimStructMethods;

#endif
