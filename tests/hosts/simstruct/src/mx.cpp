#include "matrix.h"

#include "simstruct/model.hpp"

#include <cstring>
#include <map>
#include <string>

struct mxArray_tag {
    mxClassID type = mxDOUBLE_CLASS;
    size_t rows = 0, cols = 0;
    std::vector<unsigned char> bytes; // characters take one byte here
    std::vector<mxArray*> cells;
    std::map<std::string, std::vector<mxArray*>> fields;
};

namespace {

size_t element_bytes(mxClassID type) {
    switch (type) {
    case mxDOUBLE_CLASS:
    case mxINT64_CLASS:
    case mxUINT64_CLASS: return 8;
    case mxSINGLE_CLASS:
    case mxINT32_CLASS:
    case mxUINT32_CLASS: return 4;
    case mxINT16_CLASS:
    case mxUINT16_CLASS: return 2;
    default: return 1;
    }
}

mxArray* make(mxClassID type, size_t rows, size_t cols) {
    auto* array = new mxArray_tag;
    array->type = type;
    array->rows = rows;
    array->cols = cols;
    array->bytes.resize(rows * cols * element_bytes(type));
    return array;
}

} // namespace

extern "C" {

mxClassID mxGetClassID(const mxArray* array) { return array->type; }
const char* mxGetClassName(const mxArray* array) {
    static const char* const names[] = {"unknown", "cell",   "struct", "logical", "char",           "void",
                                        "double",  "single", "int8",   "uint8",   "int16",          "uint16",
                                        "int32",   "uint32", "int64",  "uint64",  "function_handle"};
    return names[array->type];
}
bool mxIsNumeric(const mxArray* array) {
    return array->type >= mxDOUBLE_CLASS && array->type <= mxUINT64_CLASS;
}
bool mxIsLogical(const mxArray* array) { return array->type == mxLOGICAL_CLASS; }
bool mxIsChar(const mxArray* array) { return array->type == mxCHAR_CLASS; }
bool mxIsCell(const mxArray* array) { return array->type == mxCELL_CLASS; }
bool mxIsStruct(const mxArray* array) { return array->type == mxSTRUCT_CLASS; }
bool mxIsComplex(const mxArray*) { return false; }
bool mxIsSparse(const mxArray*) { return false; }
mwSize mxGetNumberOfDimensions(const mxArray*) { return 2; }
size_t mxGetM(const mxArray* array) { return array->rows; }
size_t mxGetN(const mxArray* array) { return array->cols; }
size_t mxGetNumberOfElements(const mxArray* array) { return array->rows * array->cols; }
void* mxGetData(const mxArray* array) { return const_cast<unsigned char*>(array->bytes.data()); }
mxArray* mxGetCell(const mxArray* array, mwIndex index) {
    return index < array->cells.size() ? array->cells[index] : nullptr;
}
mxArray* mxGetField(const mxArray* array, mwIndex index, const char* name) {
    const auto field = array->fields.find(name);
    return field != array->fields.end() && index < field->second.size() ? field->second[index] : nullptr;
}
char* mxArrayToString(const mxArray* array) {
    if (array->type != mxCHAR_CLASS) return nullptr;
    char* text = new char[array->bytes.size() + 1]();
    if (!array->bytes.empty()) std::memcpy(text, array->bytes.data(), array->bytes.size());
    return text;
}
void mxFree(void* memory) { delete[] static_cast<char*>(memory); }

mxArray* mxCreateNumericMatrix(mwSize rows, mwSize cols, mxClassID type, mxComplexity) {
    return make(type, rows, cols);
}
mxArray* mxCreateDoubleMatrix(mwSize rows, mwSize cols, mxComplexity) {
    return make(mxDOUBLE_CLASS, rows, cols);
}
mxArray* mxCreateLogicalMatrix(mwSize rows, mwSize cols) { return make(mxLOGICAL_CLASS, rows, cols); }
mxArray* mxCreateString(const char* text) {
    const size_t length = std::strlen(text);
    mxArray* array = make(mxCHAR_CLASS, length ? 1 : 0, length);
    if (length) std::memcpy(array->bytes.data(), text, length);
    return array;
}
mxArray* mxCreateCellMatrix(mwSize rows, mwSize cols) {
    mxArray* array = make(mxCELL_CLASS, rows, cols);
    array->cells.resize(rows * cols);
    return array;
}
mxArray* mxCreateStructMatrix(mwSize rows, mwSize cols, int fields, const char** names) {
    mxArray* array = make(mxSTRUCT_CLASS, rows, cols);
    for (int i = 0; i < fields; ++i) array->fields[names[i]].resize(rows * cols);
    return array;
}
void mxSetCell(mxArray* array, mwIndex index, mxArray* value) { array->cells[index] = value; }
void mxSetField(mxArray* array, mwIndex index, const char* name, mxArray* value) {
    array->fields[name][index] = value;
}
mxArray* mxDuplicateArray(const mxArray* array) {
    auto* copy = new mxArray_tag(*array);
    for (auto& cell : copy->cells)
        if (cell) cell = mxDuplicateArray(cell);
    for (auto& field : copy->fields)
        for (auto& value : field.second)
            if (value) value = mxDuplicateArray(value);
    return copy;
}
void mxDestroyArray(mxArray* array) {
    if (!array) return;
    for (auto* cell : array->cells) mxDestroyArray(cell);
    for (auto& field : array->fields)
        for (auto* value : field.second) mxDestroyArray(value);
    delete array;
}

} // extern "C"

namespace simstruct {

mxArray* number(double x) { return matrix(1, 1, {x}); }

mxArray* matrix(int rows, int cols, const std::vector<double>& columns, mxClassID type) {
    mxArray* array =
        mxCreateNumericMatrix(static_cast<mwSize>(rows), static_cast<mwSize>(cols), type, mxREAL);
    const auto fill = [&](auto* to) {
        for (const double x : columns) *to++ = static_cast<std::remove_reference_t<decltype(*to)>>(x);
    };
    switch (type) {
    case mxSINGLE_CLASS: fill(static_cast<float*>(mxGetData(array))); break;
    case mxINT8_CLASS: fill(static_cast<int8_T*>(mxGetData(array))); break;
    case mxUINT8_CLASS: fill(static_cast<uint8_T*>(mxGetData(array))); break;
    case mxINT16_CLASS: fill(static_cast<int16_T*>(mxGetData(array))); break;
    case mxUINT16_CLASS: fill(static_cast<uint16_T*>(mxGetData(array))); break;
    case mxINT32_CLASS: fill(static_cast<int32_T*>(mxGetData(array))); break;
    case mxUINT32_CLASS: fill(static_cast<uint32_T*>(mxGetData(array))); break;
    default: fill(static_cast<double*>(mxGetData(array)));
    }
    return array;
}

mxArray* logical(bool x) {
    mxArray* array = mxCreateLogicalMatrix(1, 1);
    *static_cast<unsigned char*>(mxGetData(array)) = x;
    return array;
}
mxArray* text(const std::string& x) { return mxCreateString(x.c_str()); }
mxArray* texts(const std::vector<std::string>& x) {
    mxArray* array = mxCreateCellMatrix(x.empty() ? 0 : 1, x.size());
    for (size_t i = 0; i < x.size(); ++i) mxSetCell(array, i, text(x[i]));
    return array;
}

} // namespace simstruct
