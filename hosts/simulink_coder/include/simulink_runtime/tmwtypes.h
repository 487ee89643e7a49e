/* Types of generated code, by their documented names and sizes. */
#ifndef BLOCKFACTORY_TMWTYPES_H
#define BLOCKFACTORY_TMWTYPES_H

#include <stddef.h>
#include <stdint.h>

typedef int8_t int8_T;
typedef uint8_t uint8_T;
typedef int16_t int16_T;
typedef uint16_t uint16_T;
typedef int32_t int32_T;
typedef uint32_t uint32_T;
typedef int64_t int64_T;
typedef uint64_t uint64_T;
typedef float real32_T;
typedef double real64_T;
typedef double real_T;
typedef double time_T;
typedef uint8_T boolean_T;
typedef char char_T;
typedef unsigned char uchar_T;
typedef char byte_T;
typedef int int_T;
typedef unsigned int uint_T;
typedef unsigned long ulong_T;
typedef void* pointer_T;

typedef struct {
    real32_T re, im;
} creal32_T;
typedef struct {
    real_T re, im;
} creal_T;
typedef creal_T creal64_T;

#define MAX_int8_T ((int8_T)INT8_MAX)
#define MIN_int8_T ((int8_T)INT8_MIN)
#define MAX_uint8_T ((uint8_T)UINT8_MAX)
#define MAX_int16_T ((int16_T)INT16_MAX)
#define MIN_int16_T ((int16_T)INT16_MIN)
#define MAX_uint16_T ((uint16_T)UINT16_MAX)
#define MAX_int32_T ((int32_T)INT32_MAX)
#define MIN_int32_T ((int32_T)INT32_MIN)
#define MAX_uint32_T ((uint32_T)UINT32_MAX)

#ifndef __cplusplus
#ifndef false
#define false ((boolean_T)0)
#define true ((boolean_T)1)
#endif
#endif
#ifndef TRUE
#define TRUE 1
#define FALSE 0
#endif
#ifndef UNUSED_PARAMETER
#define UNUSED_PARAMETER(x) (void)(x)
#endif
#ifndef NULL
#define NULL 0
#endif

#endif
