/* A loop whose rounds are shared out among threads. */
#ifndef LUTGEN_PARALLEL_H
#define LUTGEN_PARALLEL_H

/* Call body(context, index) for each index below count, on thread_count threads (0: as many as processors
 * that the process may run on); what a round does must not depend on another. If a thread cannot be started
 * the others do its share. */
void lut_parallel_for(int count, int thread_count, void (*body)(void *context, int index), void *context);

#endif
