!> What the program does with its command line: look something up, check a case, replay a member,
!> or run the ensemble.
module sg_program
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use sg_collapse, only: collapse_model_t
  use sg_comm, only: comm_t
  use sg_command_line, only: options_t, parse_command_line, usage_text
  use sg_config, only: config_t
  use sg_driver, only: run_ensemble, run_request_t
  use sg_errors, only: error_t, EXIT_INTERNAL, EXIT_OK
  use sg_estimate, only: estimate_text
  use sg_key_listing, only: print_defaults, print_keys
  use sg_plan, only: create_plan, plan_t
  use sg_posix, only: read_text
  use sg_read_config, only: read_config
  use sg_replay, only: choose_member, replay_member
  use sg_resolved, only: compare_configs, resolved_text
  use sg_text, only: to_text
  use sg_threads, only: core_set, threads_warning
  use sg_version, only: GIT_HASH, VERSION
  use sg_write_fields, only: write_fields
  implicit none
  private

  public :: run_program

contains

  !> Collective. `exit_code` is the same on all ranks; see the EXIT_ constants.
  subroutine run_program(comm, exit_code)
    type(comm_t), intent(in) :: comm
    integer, intent(out) :: exit_code
    type(options_t) :: options
    type(error_t), allocatable :: error
    character(len=:), allocatable :: text

    exit_code = EXIT_OK
    call parse_command_line(arguments(), options, error)
    if (.not. allocated(error)) then
      if (options%help) then
        call say(comm, usage_text())
      else if (options%version) then
        call say(comm, 'sgimp '//VERSION//' ('//GIT_HASH//')')
      else if (options%keys) then
        call print_keys(options%keys_group, options%json, text, error)
        if (.not. allocated(error)) call say(comm, text)
      else if (options%defaults) then
        call say(comm, print_defaults())
      else
        call run_case(comm, options, exit_code, error)
      end if
    end if
    if (allocated(error)) then
      if (comm%rank() == 0) call complain(options%case_file, error%message)
      exit_code = error%code
      if (exit_code == EXIT_OK) exit_code = EXIT_INTERNAL
    end if
  end subroutine run_program

  !> Everything that needs a case file.
  subroutine run_case(comm, options, exit_code, error)
    type(comm_t), intent(in) :: comm
    type(options_t), intent(in) :: options
    integer, intent(out) :: exit_code
    type(error_t), allocatable, intent(out) :: error
    type(config_t) :: config
    type(plan_t) :: plan
    type(collapse_model_t) :: model
    type(run_request_t) :: request
    character(len=:), allocatable :: text
    integer :: case_index

    exit_code = EXIT_OK
    call load_case(comm, options%case_file, text, config, error)
    if (allocated(error)) return
    if (options%output /= '') config%output%directory = options%output
    request%warning = threads_warning(config%solver%threads, comm%count_alike(core_set()))
    call create_plan(config, plan)
    if (options%realization > 0 .and. options%write_fields == '') then
      call choose_member(plan, options, case_index, error)
    end if
    if (allocated(error)) return
    if (options%check) then
      if (comm%rank() == 0) call say_estimate(comm, config, plan, error)
      if (request%warning /= '' .and. .not. allocated(error)) call say(comm, &
        'warning         '//request%warning)
      if (options%realization > 0 .and. .not. allocated(error)) call say(comm, &
        'realization     '//to_text(options%realization)//' of '// &
        trim(plan%cases(case_index)%label)//' can be computed by itself')
      call comm%agree(error)
      return
    end if
    if (comm%rank() == 0 .or. (options%realization == 0 .and. options%write_fields == '')) then
      call model%init(config, plan, error)
    end if
    call comm%agree(error)
    if (allocated(error)) return
    if (options%write_fields /= '') then
      if (comm%rank() == 0) call write_fields(model, options, error)
      call comm%agree(error)
      return
    else if (options%realization > 0) then
      if (comm%rank() == 0) call replay_member(model, options, case_index)
      return
    end if
    request%config = config
    request%plan = plan
    request%profile_x = model%scene%profile_x
    request%case_text = text
    request%resolved = resolved_text(config)
    request%field_method = model%field_method()
    request%fields = model%field_records()
    request%toe = model%scene%toe
    request%initial_width = model%scene%extent(2) - model%scene%extent(1)
    request%initial_height = model%scene%extent(4) - model%scene%extent(3)
    request%point_spacing = maxval(model%scene%particles%bodies%width)
    request%overwrite = options%overwrite
    request%walltime = options%walltime
    request%compare => compare_configs
    call run_ensemble(comm, request, model, exit_code, error)
  end subroutine run_case

  !> Rank 0 reads the file; every rank reads the configuration out of the same text.
  subroutine load_case(comm, file_name, text, config, error)
    type(comm_t), intent(in) :: comm
    character(len=*), intent(in) :: file_name
    character(len=:), allocatable, intent(out) :: text
    type(config_t), intent(out) :: config
    type(error_t), allocatable, intent(out) :: error

    text = ''
    if (comm%rank() == 0) call read_text(file_name, text, error)
    call comm%agree(error)
    if (allocated(error)) return
    call comm%broadcast_text(text)
    call read_config(text, file_name, config, error)
  end subroutine load_case

  subroutine say_estimate(comm, config, plan, error)
    type(comm_t), intent(in) :: comm
    type(config_t), intent(in) :: config
    type(plan_t), intent(in) :: plan
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: text

    call estimate_text(config, plan, text, error)
    if (.not. allocated(error)) call say(comm, text)
  end subroutine say_estimate

  !> On standard error. Faults of a case file begin with its name, as compilers have it; others with
  !> the program's.
  subroutine complain(case_file, message)
    character(len=*), intent(in) :: case_file, message

    if (case_file /= '' .and. index(message, case_file//':') == 1) then
      write (error_unit, '(a)') message
    else
      write (error_unit, '(a)') 'sgimp: '//message
    end if
  end subroutine complain

  !> On standard output, once.
  subroutine say(comm, text)
    type(comm_t), intent(in) :: comm
    character(len=*), intent(in) :: text

    if (comm%rank() == 0) write (output_unit, '(a)') text
  end subroutine say

  !> The words of the command line after the program's name.
  function arguments() result(words)
    character(len=:), allocatable :: words(:)
    integer :: k, length, longest

    longest = 1
    do k = 1, command_argument_count()
      call get_command_argument(k, length=length)
      longest = max(longest, length)
    end do
    allocate (character(len=longest) :: words(command_argument_count()))
    do k = 1, size(words)
      call get_command_argument(k, words(k))
    end do
  end function arguments
end module sg_program
