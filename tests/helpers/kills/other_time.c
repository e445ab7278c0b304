/* The clock on the wall, set by the seconds in the file OTHER_TIME as soon as there is one. */
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

int clock_gettime(clockid_t id, struct timespec *at) {
  int result = syscall(SYS_clock_gettime, id, at);
  long shift = 0;
  FILE *file = id == CLOCK_REALTIME ? fopen(getenv("OTHER_TIME"), "r") : NULL;
  if (file != NULL) {
    if (fscanf(file, "%ld", &shift) == 1) at->tv_sec += shift;
    fclose(file);
  }
  return result;
}

time_t time(time_t *at) {
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  if (at != NULL) *at = now.tv_sec;
  return now.tv_sec;
}

int gettimeofday(struct timeval *at, void *zone) {
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  at->tv_sec = now.tv_sec;
  at->tv_usec = now.tv_nsec / 1000;
  return 0;
}
