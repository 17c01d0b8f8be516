!> Returns trial stresses with the kernels of the program, for the comparison with an independent
!> implementation. Usage: return_driver CASE.nml STATES.bin RETURNED.bin
!> CASE.nml is a whole case file, its first material counts. STATES.bin: rows of xx, yy, zz, xy in
!> Pa as float64, a multiple of no number in particular. RETURNED.bin: rows of xx, yy, zz, xy, gap.
program return_driver
  use case_file, only: read_case
  use sg_config, only: config_t
  use sg_kinds, only: wp
  use sg_materials, only: create_material, material_t, MODEL_MOHR_COULOMB, mohr_coulomb_strength
  use sg_particles, only: particles_t
  use sg_stress_update, only: return_block
  use sg_weighting, only: BLOCK
  implicit none

  type(config_t) :: config
  type(material_t) :: material
  type(particles_t) :: points
  character(len=512) :: case_path, states_file, returned_file
  real(wp), allocatable :: states(:, :)
  integer :: unit, bytes, n, p

  call get_command_argument(1, case_path)
  call get_command_argument(2, states_file)
  call get_command_argument(3, returned_file)
  call read_case(trim(case_path), config)
  material = create_material(config%materials(1))
  open (newunit=unit, file=trim(states_file), access='stream', form='unformatted', status='old')
  inquire (unit=unit, size=bytes)
  n = bytes/(4*8)
  allocate (states(4, n))
  read (unit) states
  close (unit)

  call points%init(n)
  points%sxx = states(1, :)
  points%syy = states(2, :)
  points%szz = states(3, :)
  points%sxy = states(4, :)
  points%friction_angle = material%friction_angle
  if (material%model == MODEL_MOHR_COULOMB) call mohr_coulomb_strength(material, &
    points%friction_angle, material%cohesion, points%sin_friction, points%cohesion_term, &
    points%tension_limit)
  if (material%softens) call points%track_plastic_strain()
  do p = 1, n, BLOCK
    call return_block(points, material, p, min(p + BLOCK - 1, n))
  end do
  open (newunit=unit, file=trim(returned_file), access='stream', form='unformatted', &
    status='replace')
  write (unit) (points%sxx(p), points%syy(p), points%szz(p), points%sxy(p), points%gap(p), p=1, n)
  close (unit)
end program return_driver
