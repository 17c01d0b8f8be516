!> SGIMP: how far will it run, and with what probability? The only place that ends the program.
program main
  use sg_comm, only: comm_t
  use sg_errors, only: EXIT_OK
  use sg_posix, only: end_program
  use sg_program, only: run_program
  implicit none

  type(comm_t) :: comm
  integer :: exit_code

  call comm%init()
  call run_program(comm, exit_code)
  call comm%finalize()
  if (exit_code /= EXIT_OK) call end_program(exit_code)
end program main
