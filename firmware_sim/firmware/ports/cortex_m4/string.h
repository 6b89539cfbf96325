/* string.h: what freestanding C lacks and compilers call by themselves; ziglang defines it, for GCC memory.c. */
#ifndef MARCONET_STRING_H
#define MARCONET_STRING_H

#include <stddef.h>

void *memcpy(void *restrict to, const void *restrict from, size_t length);
void *memmove(void *to, const void *from, size_t length);
void *memset(void *to, int byte, size_t length);
int memcmp(const void *a, const void *b, size_t length);

#endif
