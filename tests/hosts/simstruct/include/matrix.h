/* MATLAB's arrays as C programs see them: the functions that the S-function uses, by their documented names
   and meanings. Only what can reach a block's parameter: numbers, logicals, texts, cells and structs of two
   dimensions. */
#ifndef BLOCKFACTORY_SIMSTRUCT_MATRIX_H
#define BLOCKFACTORY_SIMSTRUCT_MATRIX_H

#include "tmwtypes.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct mxArray_tag mxArray;
typedef size_t mwSize;
typedef size_t mwIndex;

typedef enum {
    mxUNKNOWN_CLASS,
    mxCELL_CLASS,
    mxSTRUCT_CLASS,
    mxLOGICAL_CLASS,
    mxCHAR_CLASS,
    mxVOID_CLASS,
    mxDOUBLE_CLASS,
    mxSINGLE_CLASS,
    mxINT8_CLASS,
    mxUINT8_CLASS,
    mxINT16_CLASS,
    mxUINT16_CLASS,
    mxINT32_CLASS,
    mxUINT32_CLASS,
    mxINT64_CLASS,
    mxUINT64_CLASS,
    mxFUNCTION_CLASS
} mxClassID;
typedef enum { mxREAL, mxCOMPLEX } mxComplexity;

mxClassID mxGetClassID(const mxArray* array);
const char* mxGetClassName(const mxArray* array);
bool mxIsNumeric(const mxArray* array); /* false for logicals */
bool mxIsLogical(const mxArray* array);
bool mxIsChar(const mxArray* array);
bool mxIsCell(const mxArray* array);
bool mxIsStruct(const mxArray* array);
bool mxIsComplex(const mxArray* array);
bool mxIsSparse(const mxArray* array);
mwSize mxGetNumberOfDimensions(const mxArray* array);
size_t mxGetM(const mxArray* array);
size_t mxGetN(const mxArray* array);
size_t mxGetNumberOfElements(const mxArray* array);
void* mxGetData(const mxArray* array);
mxArray* mxGetCell(const mxArray* array, mwIndex index);
mxArray* mxGetField(const mxArray* array, mwIndex index, const char* name);
char* mxArrayToString(const mxArray* array); /* null unless characters; to be freed by mxFree */
void mxFree(void* memory);

mxArray* mxCreateNumericMatrix(mwSize rows, mwSize cols, mxClassID type, mxComplexity complexity);
mxArray* mxCreateDoubleMatrix(mwSize rows, mwSize cols, mxComplexity complexity);
mxArray* mxCreateLogicalMatrix(mwSize rows, mwSize cols);
mxArray* mxCreateString(const char* text);
mxArray* mxCreateCellMatrix(mwSize rows, mwSize cols);
mxArray* mxCreateStructMatrix(mwSize rows, mwSize cols, int fields, const char** names);
void mxSetCell(mxArray* array, mwIndex index, mxArray* value);
void mxSetField(mxArray* array, mwIndex index, const char* name, mxArray* value);
mxArray* mxDuplicateArray(const mxArray* array);
void mxDestroyArray(mxArray* array);

#ifdef __cplusplus
}
#endif

#endif
