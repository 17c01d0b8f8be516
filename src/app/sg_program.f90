!> What the program does with its command line: look something up, check a case, replay a member,
!> or run the ensemble.
module sg_program
  use, intrinsic :: iso_fortran_env, only: error_unit, output_unit
  use sg_collapse, only: collapse_model_t
  use sg_comm, only: comm_t
  use sg_command_line, only: options_t, parse_command_line, usage_text
  use sg_driver, only: run_ensemble, run_request_t
  use sg_ensemble, only: case_geometry_t
  use sg_errors, only: error_t, EXIT_BAD_INPUT, EXIT_INTERNAL, EXIT_OK, raise
  use sg_estimate, only: estimate_text, listing_text
  use sg_key_listing, only: print_defaults, print_keys
  use sg_kinds, only: wp
  use sg_plan, only: create_plan, plan_t
  use sg_posix, only: read_text
  use sg_read_config, only: read_variants
  use sg_replay, only: choose_member, replay_member
  use sg_resolved, only: compare_configs, identity_text, resolved_text
  use sg_study, only: variant_t
  use sg_text, only: to_text
  use sg_threads, only: core_set, threads_warning
  use sg_timer, only: wall_seconds
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
    real(wp) :: begin

    exit_code = EXIT_OK
    begin = wall_seconds()
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
        call run_case(comm, options, begin, exit_code, error)
      end if
    end if
    if (allocated(error)) then
      if (comm%rank() == 0) call complain(options%case_file, error%message)
      exit_code = error%code
      if (exit_code == EXIT_OK) exit_code = EXIT_INTERNAL
    end if
  end subroutine run_program

  !> Everything that needs a case file.
  subroutine run_case(comm, options, begin, exit_code, error)
    type(comm_t), intent(in) :: comm
    type(options_t), intent(in) :: options
    !> When the program began, as `wall_seconds` has it.
    real(wp), intent(in) :: begin
    integer, intent(out) :: exit_code
    type(error_t), allocatable, intent(out) :: error
    type(variant_t), allocatable :: variants(:)
    type(plan_t) :: plan
    type(collapse_model_t) :: model
    type(run_request_t) :: request
    character(len=:), allocatable :: text
    integer :: case_index, v

    exit_code = EXIT_OK
    call load_case(comm, options%case_file, text, variants, error)
    if (allocated(error)) return
    do v = 1, size(variants)
      if (options%output /= '') variants(v)%config%output%directory = options%output
    end do
    request%warning = threads_warning(maxval([(variants(v)%config%solver%threads, v=1, &
      size(variants))]), comm%count_alike(core_set()))
    call create_plan(variants, plan)
    call limit_plan(options, variants(1)%config%monte_carlo%stop_rule, plan, error)
    if (options%realization > 0 .and. options%write_fields == '' .and. .not. allocated(error)) then
      call choose_member(plan, options, case_index, error)
    end if
    if (allocated(error)) return
    if (options%dry) then
      call say(comm, listing_text(plan))
      return
    else if (options%check) then
      if (comm%rank() == 0) call say_estimate(comm, variants, plan, error)
      if (request%warning /= '' .and. .not. allocated(error)) call say(comm, &
        'warning         '//request%warning)
      if (options%realization > 0 .and. .not. allocated(error)) call say(comm, &
        'realization     '//to_text(options%realization)//' of '// &
        trim(plan%cases(case_index)%label)//' can be computed by itself')
      call comm%agree(error)
      return
    end if
    if (comm%rank() == 0 .or. (options%realization == 0 .and. options%write_fields == '')) then
      call model%init(variants, plan, error)
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
    request%config = variants(1)%config
    request%plan = plan
    request%geometries = geometries_of(model)
    request%case_text = text
    request%resolved = resolved_text(request%config)
    request%identity = identity_text(request%config)
    request%field_method = model%grounds(model%field_ground())%field_method()
    request%fields = model%grounds(model%field_ground())%field_records()
    request%overwrite = options%overwrite
    ! Factors of large fields have taken their time by now.
    if (options%walltime > 0.0_wp) request%walltime = max(options%walltime - (wall_seconds() - &
      begin), tiny(begin))
    request%compare => compare_configs
    call run_ensemble(comm, request, model, exit_code, error)
  end subroutine run_case

  !> Leaves to the plan the members that the options ask for; none at all is bad input, and so are
  !> some where a rule looks at the members from the first on.
  subroutine limit_plan(options, stop_rule, plan, error)
    type(options_t), intent(in) :: options
    character(len=*), intent(in) :: stop_rule
    type(plan_t), intent(inout) :: plan
    type(error_t), allocatable, intent(out) :: error

    plan%first = options%members(1)
    plan%last = options%members(2)
    if (plan%is_part() .and. stop_rule /= 'count') then
      call raise(error, EXIT_BAD_INPUT, '--members goes with stop_rule = ''count'' alone: '// &
        trim(stop_rule)//' looks at the members from 1 on', 'command line')
      return
    end if
    if (plan%total() == 0) call raise(error, EXIT_BAD_INPUT, '--members '// &
      to_text(plan%first)//'-'//to_text(plan%last)//': there is no such member (allowed: 1 to '// &
      to_text(maxval(plan%cases%member_count))//')', 'command line')
  end subroutine limit_plan

  !> Of each case of the plan.
  function geometries_of(model) result(geometries)
    type(collapse_model_t), intent(in) :: model
    type(case_geometry_t), allocatable :: geometries(:)
    integer :: k

    allocate (geometries(size(model%plan%cases)))
    do k = 1, size(geometries)
      associate (g => geometries(k), ground => model%grounds(model%plan%cases(k)%variant))
        associate (scene => ground%scene, grid => ground%config%grid)
          g%toe = scene%toe
          g%initial_width = scene%extent(2) - scene%extent(1)
          g%initial_height = scene%extent(4) - scene%extent(3)
          g%point_spacing = maxval(scene%particles%bodies%width)
          g%x_min = grid%x_min
          g%x_max = grid%x_max
          g%y_min = grid%y_min
          g%y_max = grid%y_max
          g%cell_size = grid%cell_size
          g%profile_x = scene%profile_x
          g%has_recorded_fields = ground%source == model%grounds(1)%source .and. &
            .not. allocated(ground%restrictions)
        end associate
      end associate
    end do
  end function geometries_of

  !> Rank 0 reads the file; every rank reads the variants of the case out of the same text.
  subroutine load_case(comm, file_name, text, variants, error)
    type(comm_t), intent(in) :: comm
    character(len=*), intent(in) :: file_name
    character(len=:), allocatable, intent(out) :: text
    type(variant_t), allocatable, intent(out) :: variants(:)
    type(error_t), allocatable, intent(out) :: error

    text = ''
    if (comm%rank() == 0) call read_text(file_name, text, error)
    call comm%agree(error)
    if (allocated(error)) return
    call comm%broadcast_text(text)
    call read_variants(text, file_name, variants, error)
  end subroutine load_case

  subroutine say_estimate(comm, variants, plan, error)
    type(comm_t), intent(in) :: comm
    type(variant_t), intent(in) :: variants(:)
    type(plan_t), intent(in) :: plan
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: text

    call estimate_text(variants, plan, text, error)
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
