!> The whole ensemble: prepares the run directory, resumes, distributes members, keeps results.
module sg_driver
  use sg_comm, only: comm_t
  use sg_config, only: config_t
  use sg_errors, only: error_t, EXIT_OK
  use sg_kinds, only: wp
  use sg_member_model, only: member_model_t
  use sg_plan, only: plan_t
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
    !> Cell centres of the columns of the profile, in m; `outcome%height` has the same size.
    real(wp), allocatable :: profile_x(:)
    !> The case file verbatim, and every key resolved.
    character(len=:), allocatable :: case_text, resolved
    !> Initial toe, from which runouts are measured, and extent of the body, and the spacing of
    !> points, in m.
    real(wp) :: toe = 0.0_wp, initial_height = 0.0_wp, initial_width = 0.0_wp
    real(wp) :: point_spacing = 0.0_wp
    !> Throw away what the directory holds of earlier runs.
    logical :: overwrite = .false.
    !> Wall clock limit of the whole run in s, counted from the start of the program; 0 = none.
    real(wp) :: walltime = 0.0_wp
    !> `compare_configs` of sg_resolved; without it any difference of the texts counts.
    procedure(compare_interface), pointer, nopass :: compare => null()
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

    exit_code = EXIT_OK
  end subroutine run_ensemble
end module sg_driver
