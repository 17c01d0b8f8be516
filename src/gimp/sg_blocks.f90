!> How points and nodes are shared out: points in blocks, and rows of nodes in strips, one for each
!> thread.
module sg_blocks
  use sg_kinds, only: i8
  use sg_weighting, only: BLOCK
  implicit none
  private

  public :: block_t, strip_t, cut_into_blocks, share_out_rows

  !> Up to BLOCK points of one body, `first` to `last`.
  type :: block_t
    integer :: body, first, last
    !> First and last row of nodes that they can reach; kept up where there are several threads.
    integer :: rows(2) = 0
  end type block_t

  !> Where a thread maps to: rows of nodes, and the node where it throws away what is not for them.
  type :: strip_t
    integer :: rows(2), spare
  end type strip_t

contains

  !> Blocks of the bodies whose points are first(body) to last(body).
  pure function cut_into_blocks(first, last) result(blocks)
    integer, intent(in) :: first(:), last(:)
    type(block_t), allocatable :: blocks(:)
    integer :: body, k

    allocate (blocks(0))
    do body = 1, size(first)
      blocks = [blocks, (block_t(body, k, min(k + BLOCK - 1, last(body))), k=first(body), &
        last(body), BLOCK)]
    end do
  end function cut_into_blocks

  !> Shares the rows of nodes 0 to `last_row` out to the strips, with about as many blocks for each.
  pure subroutine share_out_rows(blocks, last_row, strips)
    type(block_t), intent(in) :: blocks(:)
    integer, intent(in) :: last_row
    type(strip_t), intent(inout) :: strips(:)
    integer :: blocks_at(0:last_row), row, k, s, passed

    blocks_at = 0
    do k = 1, size(blocks)
      row = sum(blocks(k)%rows)/2
      blocks_at(row) = blocks_at(row) + 1
    end do
    row = 0
    passed = 0
    do s = 1, size(strips)
      strips(s)%rows(1) = row
      do while (passed < size(blocks, kind=i8)*s/size(strips))
        passed = passed + blocks_at(row)
        row = row + 1
      end do
      strips(s)%rows(2) = row - 1
    end do
    strips(size(strips))%rows(2) = last_row
  end subroutine share_out_rows
end module sg_blocks
