/* stdio.h: empty, for headers that include it and print nothing. */
