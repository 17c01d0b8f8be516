!> The whole ensemble: prepares the run directory, resumes, distributes members, keeps results.
module sg_driver
  use sg_comm, only: comm_t
  use sg_config, only: config_t
  use sg_director, only: ensemble_director_t
  use sg_ensemble, only: case_geometry_t, ENSEMBLE_NAME
  use sg_errors, only: error_t, EXIT_BAD_INPUT, EXIT_OK, EXIT_STOPPED_EARLY, &
    EXIT_TOO_MANY_FAILED, raise
  use sg_field_record, only: field_record_t
  use sg_journal, only: damage_t
  use sg_kinds, only: i8, wp
  use sg_member_model, only: member_model_t
  use sg_outcome, only: outcome_t
  use sg_plan, only: plan_t
  use sg_posix, only: catch_signals, hash_text, host_name, make_directory, remove_file, &
    remove_files, utc_time, write_file
  use sg_progress, only: id_list, json_text
  use sg_scheduler, only: run_members
  use sg_statistics, only: sample_statistics_t
  use sg_stop_rule, only: make_stop_rule
  use sg_text, only: text_of_duration, to_text
  use sg_timer, only: wall_seconds
  implicit none
  private

  public :: run_request_t, run_ensemble, compare_interface

  abstract interface
    !> Lines `&group key: old -> new` of the keys by which two resolved configurations are different
    !> runs; empty if they are the same run.
    subroutine compare_interface(old_text, new_text, differences, error)
      import :: error_t
      implicit none
      character(len=*), intent(in) :: old_text, new_text
      character(len=:), allocatable, intent(out) :: differences
      type(error_t), allocatable, intent(out) :: error
    end subroutine compare_interface
  end interface

  !> What to run, the same on all ranks.
  type :: run_request_t
    type(config_t) :: config
    type(plan_t) :: plan
    !> Of each case of the plan.
    type(case_geometry_t), allocatable :: geometries(:)
    !> The case file verbatim, every key resolved, and those that results depend on.
    character(len=:), allocatable :: case_text, resolved, identity
    !> How the fields are sampled, and the jitter that their factors needed: one line, may be empty.
    character(len=:), allocatable :: field_method
    !> The fields themselves; size 0 or not allocated without any.
    type(field_record_t), allocatable :: fields(:)
    !> Said once when the run starts; may be empty.
    character(len=:), allocatable :: warning
    !> Throw away what the directory holds of earlier runs.
    logical :: overwrite = .false.
    !> Wall clock limit in s, counted from the call of `run_ensemble`; 0 = none.
    real(wp) :: walltime = 0.0_wp
    !> `compare_configs` of sg_resolved; without it any difference of the texts counts.
    procedure(compare_interface), pointer, nopass :: compare => null()
    !> No lines on the screen.
    logical :: is_quiet = .false.
  end type run_request_t

contains

  !> Collective. `exit_code` is EXIT_OK, EXIT_STOPPED_EARLY or EXIT_TOO_MANY_FAILED on all ranks;
  !> after an error (the same on all ranks) it is that of the error.
  subroutine run_ensemble(comm, request, model, exit_code, error)
    type(comm_t), intent(in) :: comm
    type(run_request_t), intent(in) :: request
    class(member_model_t), intent(inout) :: model
    integer, intent(out) :: exit_code
    type(error_t), allocatable, intent(out) :: error

    type(ensemble_director_t) :: director
    integer(i8), allocatable :: tasks(:, :)

    exit_code = EXIT_OK
    call catch_signals(error)
    if (.not. allocated(error) .and. comm%rank() == 0) then
      call prepare(request, comm%size(), director, error)
    end if
    call comm%agree(error)
    if (.not. allocated(error)) then
      allocate (tasks(2, 0))
      if (comm%rank() == 0) call missing_members(request%plan, director, tasks)
      call run_members(comm, tasks, director, model, request%config%monte_carlo%member_seconds)
      if (comm%rank() == 0) call finish(request, director, exit_code, error)
      call comm%agree(error)
    end if
    if (comm%rank() == 0) call director%journal%close()
    if (allocated(error)) exit_code = error%code
    call comm%broadcast_integer(exit_code)
  end subroutine run_ensemble

  !> Rank 0: the directory, what is in it of earlier runs, the first lines of the log.
  subroutine prepare(request, ranks, director, error)
    type(run_request_t), intent(in) :: request
    integer, intent(in) :: ranks
    type(ensemble_director_t), intent(inout) :: director
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: old_text
    type(outcome_t), allocatable :: outcomes(:)
    type(damage_t), allocatable :: damage(:)
    integer :: i

    call set_up(request, ranks, director)
    call make_directory(director%directory, error)
    if (allocated(error)) return
    call director%journal%open(director%directory, error)
    if (allocated(error)) return
    if (request%overwrite) then
      call clear_directory(director, error)
      if (allocated(error)) return
    end if
    call director%journal%load(old_text, outcomes, damage, error)
    if (.not. allocated(error)) call check_same_run(request, old_text, error)
    if (allocated(error)) then
      call director%journal%close()
      return
    end if
    if (len(old_text) == 0) old_text = request%resolved
    director%record%config_hash = hash_text(old_text)
    call write_file(director%directory//'/resolved.nml', request%resolved, error)
    if (allocated(error)) return
    if (size(outcomes) == 0) call director%journal%start(old_text, error)
    if (allocated(error)) return
    do i = 1, size(outcomes)
      call director%keep(outcomes(i))
    end do
    call tell_start(request, director, damage, size(outcomes))
    call director%write_results(error)
  end subroutine prepare

  !> Fills the director from the request; touches no file.
  subroutine set_up(request, ranks, director)
    type(run_request_t), intent(in) :: request
    integer, intent(in) :: ranks
    type(ensemble_director_t), intent(inout) :: director
    integer :: i

    director%plan = request%plan
    director%directory = trim(request%config%output%directory)
    director%progress%directory = director%directory
    director%progress%on_screen = .not. request%is_quiet
    director%report_seconds = request%config%output%report_seconds
    director%start = wall_seconds()
    director%last_report = director%start
    if (request%walltime > 0.0_wp) director%deadline = director%start + request%walltime
    associate (record => director%record, config => request%config)
      record%case_text = request%case_text
      record%resolved = request%resolved
      allocate (record%fields(0))
      if (allocated(request%fields)) record%fields = request%fields
      record%sampling = ''
      if (config%has_random_field) record%sampling = trim(config%monte_carlo%sampling)
      record%field_method = ''
      if (allocated(request%field_method)) record%field_method = request%field_method
      record%host = host_name()
      record%started = utc_time()
      record%ended = ''
      record%state = 'running'
      record%seed = config%monte_carlo%seed
      record%ranks = ranks
      record%realizations = config%monte_carlo%realizations
      record%identity = ''
      if (allocated(request%identity)) record%identity = request%identity
      record%members = ''
      if (request%plan%is_part()) record%members = to_text(request%plan%first)//'-'// &
        to_text(request%plan%last)
    end associate
    call director%watch%init(make_stop_rule(request%config%monte_carlo), size(request%plan%cases))
    allocate (director%results(size(request%plan%cases)))
    do i = 1, size(director%results)
      associate (r => director%results(i), c => request%plan%cases(i))
        call r%init(c%member_count, request%geometries(i))
        r%label = trim(c%label)
        r%role = c%role()
        r%varied = trim(c%varied)
        if (c%noise_case > 0) r%noise_case = trim(request%plan%cases(c%noise_case)%label)
        if (c%control_of > 0) r%control_of = trim(request%plan%cases(c%control_of)%label)
        r%acf = trim(c%acf)
        r%cov = c%cov
        r%mean = c%mean
        r%distribution = trim(c%distribution)
        r%scale_x = c%scale_x
        r%scale_y = c%scale_y
        if (size(director%record%fields) > 0) r%field_units = director%record%fields(1)%units
      end associate
    end do
  end subroutine set_up

  !> Removes what earlier runs left; the journal stays open and locked, and becomes empty.
  subroutine clear_directory(director, error)
    type(ensemble_director_t), intent(inout) :: director
    type(error_t), allocatable, intent(out) :: error
    character(len=*), parameter :: NAMES(5) = [character(len=16) :: 'resolved.nml', 'run.log', &
      'events.jsonl', 'STOP', ENSEMBLE_NAME]
    !> Folder and ending of the files of members.
    character(len=*), parameter :: MEMBER_FILES(2, 5) = reshape([character(len=12) :: &
      '/snapshots', '.h5', '/snapshots', '.xdmf', '/failures', '.h5', '/failures', '.xdmf', &
      '/failures', '.nml'], [2, 5])
    integer :: i

    call director%journal%clear(error)
    do i = 1, size(NAMES)
      if (allocated(error)) return
      call remove_file(director%directory//'/'//trim(NAMES(i)), error)
    end do
    do i = 1, size(MEMBER_FILES, 2)
      if (allocated(error)) return
      call remove_files(director%directory//trim(MEMBER_FILES(1, i)), trim(MEMBER_FILES(2, i)), &
        error)
    end do
  end subroutine clear_directory

  !> An error that names the keys when the journal belongs to another run.
  subroutine check_same_run(request, old_text, error)
    type(run_request_t), intent(in) :: request
    character(len=*), intent(in) :: old_text
    type(error_t), allocatable, intent(out) :: error
    character(len=:), allocatable :: differences

    if (len(old_text) == 0) return
    differences = ''
    if (associated(request%compare)) then
      call request%compare(old_text, request%resolved, differences, error)
      if (allocated(error)) return
    else if (old_text /= request%resolved) then
      differences = 'the resolved namelists'
    end if
    if (len_trim(differences) == 0) return
    call raise(error, EXIT_BAD_INPUT, trim(request%config%output%directory)// &
      ' holds a run with another configuration; --overwrite throws it away. What differs:'// &
      new_line('a')//differences, 'run_ensemble')
  end subroutine check_same_run

  subroutine tell_start(request, director, damage, resumed)
    type(run_request_t), intent(in) :: request
    type(ensemble_director_t), intent(inout) :: director
    type(damage_t), intent(in) :: damage(:)
    integer, intent(in) :: resumed
    integer(i8) :: done, failed
    integer :: i

    call director%count_members(done, failed)
    call director%progress%say(trim(request%config%name)//': '//to_text(director%plan%total())// &
      ' members of '//to_text(size(director%results))//' cases on '// &
      to_text(director%record%ranks)//' ranks, into '//director%directory)
    if (director%record%field_method /= '') then
      call director%progress%say('random field: '//director%record%field_method)
    end if
    if (allocated(request%warning)) then
      if (request%warning /= '') call director%progress%say('warning: '//request%warning)
    end if
    if (resumed > 0) call director%progress%say('resumed: '//to_text(done)// &
      ' members are there, '//to_text(director%plan%total() - done)//' are missing')
    do i = 1, size(damage)
      if (damage(i)%is_tail) then
        call director%progress%say('the end of the journal was cut off: '// &
          to_text(damage(i)%length)//' bytes removed')
      else if (done < director%plan%total() .and. is_missing(director, damage(i))) then
        call director%progress%say('a damaged record of the journal is left out: '// &
          damaged_name(director, damage(i))//', which is computed again')
      end if
    end do
    call director%progress%tell('start', '"members":'//to_text(director%plan%total())// &
      ',"done":'//to_text(done)//',"ranks":'//to_text(director%record%ranks)// &
      ',"host":'//json_text(director%record%host))
  end subroutine tell_start

  !> Whether a damaged record still matters: it was not computed again since.
  pure function is_missing(director, damage) result(missing)
    type(ensemble_director_t), intent(in) :: director
    type(damage_t), intent(in) :: damage
    logical :: missing

    missing = .true.
    if (director%plan%holds(damage%case_index, damage%id)) then
      missing = .not. director%results(damage%case_index)%present(damage%id)
    end if
  end function is_missing

  pure function damaged_name(director, damage) result(text)
    type(ensemble_director_t), intent(in) :: director
    type(damage_t), intent(in) :: damage
    character(len=:), allocatable :: text

    text = to_text(damage%length)//' bytes at '//to_text(damage%offset)
    if (director%plan%holds(damage%case_index, damage%id)) text = 'member '//to_text(damage%id)// &
      ' of '//director%results(damage%case_index)%label//' ('//text//')'
  end function damaged_name

  !> Members of the plan that are not there, in its order; of cases that have ended none.
  subroutine missing_members(plan, director, tasks)
    !> As it was made, before any case has ended.
    type(plan_t), intent(in) :: plan
    type(ensemble_director_t), intent(in) :: director
    integer(i8), allocatable, intent(out) :: tasks(:, :)
    integer(i8), allocatable :: all_members(:, :)
    logical, allocatable :: is_missing(:)
    integer(i8) :: k

    call plan%members_in_order(all_members)
    allocate (is_missing(size(all_members, 2, kind=i8)))
    do k = 1, size(is_missing, kind=i8)
      associate (case_index => int(all_members(1, k)), id => all_members(2, k))
        is_missing(k) = director%wants(case_index, id)
        if (is_missing(k)) is_missing(k) = .not. director%results(case_index)%present(id)
      end associate
    end do
    tasks = reshape(pack(all_members, spread(is_missing, 1, 2)), [2_i8, count(is_missing, kind=i8)])
  end subroutine missing_members

  !> Last lines, last state of the files, and the exit code.
  subroutine finish(request, director, exit_code, error)
    type(run_request_t), intent(in) :: request
    type(ensemble_director_t), intent(inout) :: director
    integer, intent(out) :: exit_code
    type(error_t), allocatable, intent(out) :: error
    type(error_t), allocatable :: ignored
    integer(i8) :: done, failed

    exit_code = EXIT_OK
    call director%count_members(done, failed)
    if (done < director%plan%total()) then
      exit_code = EXIT_STOPPED_EARLY
      if (.not. allocated(director%stop_reason)) director%stop_reason = 'a signal to another rank'
    else if (failed > request%config%monte_carlo%max_failed_fraction*real(done, wp)) then
      exit_code = EXIT_TOO_MANY_FAILED
    end if
    director%record%ended = utc_time()
    director%record%state = 'complete'
    if (exit_code == EXIT_STOPPED_EARLY) director%record%state = 'stopped'
    call director%write_results(error)
    if (allocated(error)) then
      exit_code = error%code
      director%record%state = 'stopped'
      director%stop_reason = error%message
    end if
    call tell_cases(director)
    call tell_end(director, done, failed, exit_code)
    ! The request to stop is met: the same command goes on.
    call remove_file(director%directory//'/STOP', ignored)
  end subroutine finish

  subroutine tell_end(director, done, failed, exit_code)
    type(ensemble_director_t), intent(inout) :: director
    integer(i8), intent(in) :: done, failed
    integer, intent(in) :: exit_code
    character(len=:), allocatable :: text
    integer :: i

    text = to_text(done)//' of '//to_text(director%plan%total())//' members done, '// &
           to_text(failed)//' failed, '//text_of_duration(wall_seconds() - director%start)
    select case (exit_code)
    case (EXIT_OK)
      call director%progress%say('complete: '//text)
    case (EXIT_TOO_MANY_FAILED)
      call director%progress%say('complete, but more members failed than allowed: '//text)
    case default
      call director%progress%say('stopped by '//director%stop_reason//': '//text// &
        '; the same command goes on')
      do i = 1, size(director%results)
        associate (r => director%results(i), range => director%plan%range_of(i))
          if (all(r%present(range(1):range(2)))) cycle
          call director%progress%say('not run of '//r%label//': '// &
            id_list(.not. r%present(range(1):range(2)), range(1)))
        end associate
      end do
    end select
    call director%progress%tell('end', '"state":'//json_text(director%record%state)//',"done":'// &
      to_text(done)//',"failed":'//to_text(failed)//',"exit_code":'//to_text(exit_code))
  end subroutine tell_end

  !> For each case a line over its ids without a gap, and what the rule says of them.
  subroutine tell_cases(director)
    type(ensemble_director_t), intent(inout) :: director
    type(sample_statistics_t) :: s
    character(len=:), allocatable :: text
    integer :: i

    do i = 1, size(director%results)
      s = director%statistics_of(i)
      if (s%count == 0) cycle
      text = director%results(i)%label//': runout_q995 mean '//to_text(s%mean, 6)
      if (s%half_width < huge(1.0_wp)) text = text//' +- '//to_text(s%half_width, 3)// &
        ' m (95 %), sd '//to_text(s%sd, 4)
      call director%progress%say(text//' m, n='//to_text(s%count)//' (ids '// &
        to_text(director%plan%first)//'-'//to_text(director%plan%first + director%prefix_of(i) &
        - 1)//')')
      call director%tell_rule(i)
    end do
  end subroutine tell_cases
end module sg_driver
