!> What is done before the first step: once on each rank (scene, factors of the fields), and for
!> each member (field, points, grid, first mapping), against the time of a member.
!> Usage: bench_startup CASE.nml. Processor time; judges nothing.
program bench_startup
  use case_file, only: read_case_variants, stop_on_error
  use sg_collapse, only: collapse_model_t
  use sg_errors, only: error_t
  use sg_kinds, only: i8, wp
  use sg_monitor, only: patient_monitor_t
  use sg_observer, only: blind_observer_t
  use sg_outcome, only: outcome_t, reset_outcome, STEPS
  use sg_plan, only: create_plan, plan_t
  use sg_random_fields, only: field_values_t
  use sg_scene, only: build_scene, scene_t
  use sg_simulate, only: simulate
  use sg_study, only: variant_t
  use sg_variation, only: variation_t
  implicit none

  integer, parameter :: REPEATS = 50
  type(variant_t), allocatable :: variants(:)
  type(plan_t) :: plan
  type(collapse_model_t) :: model
  type(error_t), allocatable :: error
  character(len=512) :: argument
  real(wp) :: field, preparing, whole

  call get_command_argument(1, argument)
  call read_case_variants(trim(argument), variants)
  if (.not. variants(1)%config%has_random_field) error stop 'a case with a random field is needed'
  call create_plan(variants, plan)
  call time_once()
  field = field_seconds()
  preparing = member_seconds(0, REPEATS)
  whole = member_seconds(huge(1), 1)
  print '(a)', 'for each member:'
  call say('  random field', field)
  call say('  points, grid, first mapping, measures', preparing)
  call say('  the whole member but its field', whole)
  print '(a, f7.4, a)', 'share of a member before its first step: ', &
    100.0_wp*(field + preparing)/(field + whole), ' %'

contains

  subroutine say(what, seconds)
    character(len=*), intent(in) :: what
    real(wp), intent(in) :: seconds

    print '(a, t42, f12.4, a)', what, 1.0e3_wp*seconds, ' ms'
  end subroutine say

  !> Scene and factors.
  subroutine time_once()
    type(scene_t) :: scene
    real(wp) :: started, scene_done, all_done

    call cpu_time(started)
    call build_scene(variants(1)%config, scene, error)
    call stop_on_error(error)
    call cpu_time(scene_done)
    call model%init(variants, plan, error)
    call stop_on_error(error)
    call cpu_time(all_done)
    print '(a, i0, a, i0, a)', 'once on each rank, ', scene%particles%count, ' points, ', &
      size(variants(1)%config%study%acf), ' autocorrelation functions:'
    call say('  scene', scene_done - started)
    call say('  factors of the fields', max(all_done - 2*scene_done + started, 0.0_wp))
    print '(2x, a)', model%grounds(1)%field_method()
  end subroutine time_once

  !> One random field.
  function field_seconds() result(seconds)
    real(wp) :: seconds
    type(variation_t) :: variation
    real(wp) :: started
    integer :: k

    call cpu_time(started)
    do k = 1, REPEATS
      call draw(int(k, i8), variation)
    end do
    call cpu_time(seconds)
    seconds = (seconds - started)/REPEATS
  end function field_seconds

  subroutine draw(id, variation)
    integer(i8), intent(in) :: id
    type(variation_t), intent(out) :: variation
    type(field_values_t), allocatable :: values(:)

    call model%grounds(1)%fields(1)%realize(id, values, error)
    call stop_on_error(error)
    allocate (variation%properties, source=model%grounds(1)%properties_of(values))
  end subroutine draw

  !> A member that ends after `last_step`, without its field.
  function member_seconds(last_step, repeats) result(seconds)
    integer, intent(in) :: last_step, repeats
    real(wp) :: seconds
    type(variation_t) :: variation
    type(patient_monitor_t) :: monitor
    type(blind_observer_t) :: observer
    type(outcome_t) :: outcome
    real(wp) :: started
    integer :: k

    call draw(1_i8, variation)
    variation%last_step = last_step
    call cpu_time(started)
    do k = 1, repeats
      call reset_outcome(outcome, 2, 1_i8, model%profile_size(2))
      call simulate(variants(1)%config, model%grounds(1)%scene, variation, monitor, observer, &
        outcome)
    end do
    call cpu_time(seconds)
    seconds = (seconds - started)/repeats
    if (last_step > 0) print '(i0, a)', nint(outcome%values(STEPS)), ' steps to rest'
  end function member_seconds
end program bench_startup
