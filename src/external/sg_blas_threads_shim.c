/* OpenBLAS starts a thread on every core, which MPI ranks have filled already. Other BLAS libraries do not
   have the functions; the weak references are then null. */
extern void openblas_set_num_threads(int number) __attribute__((weak));
extern int openblas_get_num_threads(void) __attribute__((weak));

void sgimp_use_one_blas_thread(void)
{
  if (openblas_set_num_threads) openblas_set_num_threads(1);
}

/* 0: the BLAS does not say. */
int sgimp_blas_threads(void)
{
  return openblas_get_num_threads ? openblas_get_num_threads() : 0;
}
