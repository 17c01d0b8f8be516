!> Reading a case file in programs that are no test suites: benchmarks and drivers.
module case_file
  use, intrinsic :: iso_fortran_env, only: error_unit
  use sg_config, only: config_t
  use sg_errors, only: error_t
  use sg_posix, only: read_text
  use sg_read_config, only: read_config, read_variants
  use sg_study, only: variant_t
  implicit none
  private

  public :: read_case, read_case_variants, stop_on_error

contains

  !> The configuration of the file `path`; ends the program where it is faulty.
  subroutine read_case(path, config)
    character(len=*), intent(in) :: path
    type(config_t), intent(out) :: config
    type(error_t), allocatable :: error
    character(len=:), allocatable :: text

    call read_text(path, text, error)
    call stop_on_error(error)
    call read_config(text, path, config, error)
    call stop_on_error(error)
  end subroutine read_case

  !> The variants of a case that its study makes, likewise.
  subroutine read_case_variants(path, variants)
    character(len=*), intent(in) :: path
    type(variant_t), allocatable, intent(out) :: variants(:)
    type(error_t), allocatable :: error
    character(len=:), allocatable :: text

    call read_text(path, text, error)
    call stop_on_error(error)
    call read_variants(text, path, variants, error)
    call stop_on_error(error)
  end subroutine read_case_variants

  !> Ends the program with the message of an error, if there is one.
  subroutine stop_on_error(error)
    type(error_t), allocatable, intent(in) :: error

    if (.not. allocated(error)) return
    write (error_unit, '(a)') error%message
    stop 2
  end subroutine stop_on_error
end module case_file
